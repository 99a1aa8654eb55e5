/* Gas volumes joined by restrictions, and two closed chambers with a moving piston. Docstrings in
   pneumo.simulation.gas_network and pneumo.fit.closed.closed_problem. */
#include "rates.h"

#define LAMINAR 5e-3 /* 1 - P_d / P_u below which a flow is proportional to it: no step follows the bare root */

typedef struct {
    const Node *nodes;
    const Link *links;
    const double *outside, *V, *areas, *ratios;
    int64_t count, n_links, n_outside, samples, sample, part, parts;
    const Gas *gas;
    double h, *P, *T, *m_in, *m_out, *mT_in;
} Network;

INLINE double between(const double *series, int64_t j, double at) {
    return series[j] + at * (series[j + 1] - series[j]);
}

INLINE void network_rates(const double *y, int stage, const void *context, double *dy) {
    const Network *net = context;
    const int64_t count = net->count, j = net->sample;
    const double at = ((double)net->part + C[stage]) / (double)net->parts, R = net->gas->R, gamma = net->gas->gamma;
    for (int64_t s = 0; s < count; s++) {
        const Node *node = net->nodes + s;
        net->P[s] = y[s];
        net->T[s] = node->lane.full != 0 ? y[count + s] : temperature(y[s], node->P_0, node->T_0, node->lane.a);
        net->m_in[s] = net->m_out[s] = net->mT_in[s] = 0;
    }
    for (int64_t s = 0; s < net->n_outside; s++) {
        net->P[count + s] = net->outside[2 * s];
        net->T[count + s] = net->outside[2 * s + 1];
    }
    for (int64_t e = 0; e < net->n_links; e++) {
        const Link *link = net->links + e;
        int64_t up = (int64_t)link->first, down = (int64_t)link->second;
        double A_t = between(net->areas + e * net->samples, j, at);
        if (net->P[down] > net->P[up]) {
            int64_t first = up;
            up = down;
            down = first;
            A_t *= link->back;
        }
        if (!(A_t > 0)) continue;
        const double P_u = net->P[up], P_d = net->P[down], T_u = net->T[up];
        Gas gas = *net->gas;
        if (link->b > 0) {
            gas.critical_ratio = link->b;
            gas.elliptic = true;
        }
        double m = mass_flow(A_t * laminar_factor(P_u, P_d, LAMINAR), P_u, P_d, T_u, &gas);
        net->m_out[up] += m;
        net->m_in[down] += m;
        net->mT_in[down] += m * T_u;
    }
    for (int64_t s = 0; s < count; s++) {
        const Node *node = net->nodes + s;
        const Lane *lane = &node->lane;
        const double *V = net->V + s * net->samples;
        const double P = y[s], T = net->T[s], m_in = net->m_in[s], m_out = net->m_out[s];
        const double dV_dt = (V[j + 1] - V[j]) / net->h, volume_now = V[j] + at * net->h * dV_dt;
        const double T_in = m_in > 0 ? net->mT_in[s] / m_in : T;
        double heat = 0;
        if (lane->wall_scale != 0) {
            double k = wall_conductance(node->k_0, between(net->ratios + s * net->samples, j, at),
                                        P * T / (node->P_0 * node->T_0), lane->e_A, lane->e_PT);
            heat = lane->wall_scale * (k * (node->T_wall - T));
        }
        dy[count + s] = dy[2 * count + s] = 0;
        if (node->c_store > 0) {
            double stored = node->k_store * (T - y[2 * count + s]);
            heat -= stored;
            dy[2 * count + s] = (stored + node->k_back * (node->T_wall - y[2 * count + s])) / node->c_store;
        } else if (node->k_back > 0) /* in series */
            heat += node->k_store * node->k_back / (node->k_store + node->k_back) * (node->T_wall - T);
        const double T_inlet = lane->mixing * T_in + (1 - lane->mixing) * T;
        dy[s] = dP_dt(P, T, volume_now, dV_dt, m_in, m_out, T_inlet, heat, lane->n_V, lane->n_in, lane->n_out, R, gamma);
        if (lane->full != 0) dy[count + s] = dT_dt(P, T, volume_now, dV_dt, m_in, m_out, dy[s], R);
    }
}

/* States (sample, 3 count): pressures, temperatures and those of the stores. Rows from the first at which one is not
   positive are not written. `work` holds 12 * 3 count + 5 (count + n_outside) + 3 count numbers. */
void replay_network(const Node *nodes, int64_t count, const Link *links, int64_t n_links, const double *outside,
                    int64_t n_outside, const double *V, const double *areas, const double *ratios, int64_t samples,
                    const Gas *gas, double h, int64_t parts, double *work, double *states) {
    const int64_t size = 3 * count, ends = count + n_outside;
    double *Y = work, *K = Y + STAGES * size, *y = K + STAGES * size, *P = y + size;
    Network net = {nodes, links, outside, V, areas, ratios, count, n_links, n_outside, samples, 0, 0, parts,
                   gas, h, P, P + ends, P + 2 * ends, P + 3 * ends, P + 4 * ends};
    for (int64_t s = 0; s < count; s++) {
        y[s] = nodes[s].P;
        y[count + s] = nodes[s].T;
        y[2 * count + s] = nodes[s].T_wall;
    }
    memcpy(states, y, (size_t)size * sizeof *y);
    for (net.sample = 0; net.sample < samples - 1; net.sample++) {
        for (net.part = 0; net.part < parts; net.part++)
            dormand_prince(network_rates, &net, y, size, h / (double)parts, Y, K, y);
        for (int64_t s = 0; s < count; s++)
            if (!(y[s] > 0 && (nodes[s].lane.full == 0 || y[count + s] > 0))) return;
        memcpy(states + (net.sample + 1) * size, y, (size_t)size * sizeof *y);
    }
}

/* Pressures (chamber, sample) of two closed chambers, by classical Runge-Kutta steps. */
void closed_chambers(const double *P, const double *measured, const bool *closed, const double *V,
                     const double *area_ratio, int64_t samples, double h, const double *start, double n,
                     const double *k, double e_A, double e_PT, double leak, double R, double gamma, double T_wall,
                     double PT_0, double *pressure) {
    double y[4], rate[4] = {0}, total[4], z[4], T[2];
    for (int c = 0; c < 2; c++) {
        y[c] = pressure[c * samples] = P[c];
        y[2 + c] = P[c] * V[c * samples] / (R * T_wall * start[c]); /* mass */
    }
    for (int64_t j = 0; j < samples - 1; j++) {
        memset(total, 0, sizeof total);
        for (int stage = 0; stage < 4; stage++) {
            const double at = stage == 0 ? 0.0 : stage == 3 ? 1.0 : 0.5;
            for (int i = 0; i < 4; i++) z[i] = y[i] + h * at * rate[i];
            for (int c = 0; c < 2; c++) {
                if (!closed[c]) {
                    z[c] = between(measured + c * samples, j, at);
                    T[c] = T_wall;
                } else
                    T[c] = z[c] * between(V + c * samples, j, at) / (z[2 + c] * R);
            }
            const double flow = leak * (z[0] - z[1]), upstream = flow > 0 ? T[0] : T[1];
            for (int c = 0; c < 2; c++) {
                if (!closed[c]) continue;
                const double in = c == 1 ? flow : -flow, m_in = larger(in, 0), m_out = larger(-in, 0);
                const double dV_dt = (V[c * samples + j + 1] - V[c * samples + j]) / h;
                const double ratio = between(area_ratio + c * samples, j, at);
                const double heat = wall_conductance(k[c], ratio, z[c] * T[c] / PT_0, e_A, e_PT) * (T_wall - T[c]);
                const double volume_now = V[c * samples + j] + at * h * dV_dt;
                rate[c] = dP_dt(z[c], T[c], volume_now, dV_dt, m_in, m_out, upstream, heat, n, n, n, R, gamma);
                rate[2 + c] = m_in - m_out;
            }
            for (int i = 0; i < 4; i++) total[i] += rate[i] * (stage == 0 || stage == 3 ? 1.0 : 2.0);
        }
        for (int i = 0; i < 4; i++) y[i] += h / 6 * total[i];
        for (int c = 0; c < 2; c++)
            pressure[c * samples + j + 1] = closed[c] ? y[c] : measured[c * samples + j + 1];
    }
}

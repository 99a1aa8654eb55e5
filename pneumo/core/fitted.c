/* Pressures of both chambers by several sets of parameters, for fits: each set is a lane with dead volumes of its own.
   Kutta's method of third order; a step that meets the pressure of the open port, where the slope of eq (1) is
   infinite, is implicit. A weight leads from one to the other, since a fit needs pressures that are smooth functions
   of the parameters. Docstrings in pneumo.simulation.fitted_pressures. */
#include "lanes.h"
#include "open_port.h"

enum { KUTTA_STAGES = 3 };
static const double A_3[3][2] = {{0}, {1.0 / 2}, {-1, 2}};
static const double B_3[3] = {1.0 / 6, 2.0 / 3, 1.0 / 6};
#define EQUAL 1e-9 /* relative difference of pressures whose logarithmic mean is either */

/* Motions of all sets, (motion, step, stage, 2), and how many lanes each has. */
typedef struct { const double *motions; int64_t n_motions, steps, width; double e_A; } Motions;

/* Volumes and wall areas of every lane at one stage; returns the position of the first motion. */
INLINE double write_geometry(const Motions *m, int64_t step, int stage, int side, const Plant *plant, int64_t n,
                             Sets *restrict X) {
    const double sign = sign_of(side);
    const Chamber chamber = chamber_of(&plant->cylinder, side);
    const int64_t place = (step * KUTTA_STAGES + stage) * 2, apart = m->steps * KUTTA_STAGES * 2;
    const double x = sign * m->motions[place], V = volume(x, chamber, &plant->cylinder);
    const double A_q = heat_area(x, &plant->cylinder);
    for (int64_t j = 0; j < m->n_motions; j++) {
        const double x_j = sign * m->motions[place + j * apart], v_j = sign * m->motions[place + j * apart + 1];
        const double V_j = volume(x_j, chamber, &plant->cylinder);
        const double area = m->e_A * (heat_area(x_j, &plant->cylinder) / A_q - 1);
        const int64_t end = j + 1 < m->n_motions ? (j + 1) * m->width : n;
        for (int64_t i = j * m->width; i < end; i++) {
            X->volume_ratio[i] = V_j;
            X->expansion[i] = chamber.area * v_j;
            X->area[i] = area;
        }
    }
    for (int64_t i = 0; i < n; i++) {
        double inverse_V = 1 / (X->volume_ratio[i] + X->beyond[side][i]);
        X->volume_ratio[i] = V * inverse_V;
        X->expansion[i] *= inverse_V;
    }
    return x;
}

INLINE double smooth_step(double x) { return x <= 0 ? 0 : x >= 1 ? 1 : x * x * (3 - 2 * x); }

/* Repeat a step by an implicit Runge-Kutta method of two stages for lanes with a `weight` of it. Near the port's
   pressure the flow's term in dp/dt is K sign(d) sqrt(|d|) with d = p_port - p, and the other terms, b, hardly change:
   they are those in the middle of the step, at the port's pressure. */
INLINE void step_across_port(Lanes *W, Sets *X, int side, bool full, bool exhausts, const Shared sh,
                             double p_port_before, const Constants *k, double h, int terms) {
    const int64_t n = W->count;
    const double p_port = sh.p_port, p_port_then = p_port_before + GAMMA * (p_port - p_port_before), root = k->psi[0] / sqrt(p_port);
    double *rate = W->k[side][0];
    for (int64_t i = 0; i < n; i++) W->p[i] = p_port;
    if (full)
        for (int64_t i = 0; i < n; i++) W->root_T[i] = sqrt(X->T[side][i]);
    write_rates(W, rate, sh, k, terms); /* at the port's pressure there is no flow */
    for (int64_t i = 0; i < n; i++) {
        const double weight = X->weight[side][i], before = W->before[side][i], root_T = W->root_T[i];
        if (!(weight > 0)) continue;
        double heated = rate[i] + X->area[i] * W->heat[i];
        double b = X->volume_ratio[i] * heated - X->expansion[i] * (W->n_V[i] * p_port);
        double factor = GAMMA * h * X->volume_ratio[i] * (exhausts ? X->exhaust[i] : 1.0) * root;
        double in = factor * (sh.inward * (W->in[i] + W->in_T[i] * (root_T * root_T)));
        double out = -factor * (sh.outward * (W->out[i] * p_port * root_T));
        double first, p = step_with_factors(before, p_port_then, p_port, h * b, in, out, &first);
        if (full) {
            double T_now = root_T * root_T, flow = (p - before) / h - b;
            double T_flow = flow > 0 ? X->inlet[i] : T_now;
            double change = p - before - h * flow / (k->plant->gas.gamma * T_flow) * T_now; /* as at a stage */
            double mean = fabs(p - before) > EQUAL * p ? (p - before) / ln(p / before) : p; /* logarithmic */
            double T = T_now * exponential(change / mean + h * X->expansion[i]);
            X->T[side][i] = weight < 1 ? T + (1 - weight) * (X->rate_T[side][0][i] - T) : T;
        }
        W->now[side][i] = weight < 1 ? p + (1 - weight) * (W->now[side][i] - p) : p;
    }
}

/* Rates of one chamber at one stage. `margin` is the least distance of a stage's pressure from the port's, negative on
   the other side of it, and `reach` a quarter of (h K)^2. */
INLINE void stage_rates(Lanes *W, Sets *X, int side, int stage, double u, double x, bool full, const Constants *k,
                        double h, int terms) {
    const int64_t n = W->count;
    const double gamma = k->plant->gas.gamma, a_0 = h * A_3[stage][0], a_1 = h * A_3[stage][1];
    double(*restrict K)[ROW] = W->k[side], *restrict rate = W->k[side][stage], *restrict now = W->now[side];
    double *restrict margin = X->margin[side], *restrict rate_T = X->rate_T[side][stage];
    const Shared sh = shared_terms(u, x, 0, side, k); /* at rest, in the plant's volume */
    for (int64_t i = 0; i < n; i++) {
        double p = now[i] + (a_0 * K[0][i] + a_1 * K[1][i]), d = now[i] >= sh.p_port ? p - sh.p_port : sh.p_port - p;
        margin[i] = stage == 0 || d < margin[i] ? d : margin[i];
        W->p[i] = p;
    }
    if (full)
        for (int64_t i = 0; i < n; i++)
            W->root_T[i] = sqrt(X->T[side][i] + (a_0 * X->rate_T[side][0][i] + a_1 * X->rate_T[side][1][i]));
    write_rates(W, rate, sh, k, terms);
    if (stage == KUTTA_STAGES - 1) {
        const double root = h * k->psi[0] / sqrt(sh.p_port);
        for (int64_t i = 0; i < n; i++) {
            double root_T = W->root_T[i], in = sh.inward * (W->in[i] + W->in_T[i] * (root_T * root_T));
            double out = -sh.outward * (W->out[i] * sh.p_port * root_T);
            double hK = (in > out ? in : out) * (sh.supplied ? 1.0 : X->exhaust[i]) * X->volume_ratio[i] * root;
            X->reach[side][i] = hK * hK / 4;
        }
    }
    if (!sh.supplied)
        for (int64_t i = 0; i < n; i++) rate[i] = W->heat[i] + X->exhaust[i] * (rate[i] - W->heat[i]);
    for (int64_t i = 0; i < n; i++) {
        double energy = rate[i] - W->heat[i], heated = rate[i] + X->area[i] * W->heat[i];
        rate[i] = X->volume_ratio[i] * heated - X->expansion[i] * (W->n_V[i] * W->p[i]);
        if (!full) continue;
        double T_now = W->root_T[i] * W->root_T[i], T_flow = energy > 0 ? X->inlet[i] : T_now;
        double change = rate[i] - X->volume_ratio[i] * energy / (gamma * T_flow) * T_now; /* less p dm/dt over m */
        rate_T[i] = T_now * (change / W->p[i] + X->expansion[i]); /* P V = m R T */
    }
}

/* Pressures, and temperatures of the full order, at the end of an explicit step, and the implicit one's weight; returns
   whether that is positive in a lane. */
INLINE bool step_end(Lanes *W, Sets *X, int side, bool full, double p_port, double h) {
    const int64_t n = W->count;
    double(*restrict K)[ROW] = W->k[side], *restrict now = W->now[side], *restrict before = W->before[side];
    double *restrict weight = X->weight[side];
    double meeting = 0;
    for (int64_t i = 0; i < n; i++) {
        double p = now[i] + h * (B_3[0] * K[0][i] + B_3[1] * K[1][i] + B_3[2] * K[2][i]);
        double d = now[i] >= p_port ? p - p_port : p_port - p, reach = X->reach[side][i];
        double margin = d < X->margin[side][i] ? d : X->margin[side][i];
        weight[i] = margin < reach && reach > NEAR ? smooth_step(1 - margin / reach) : 0;
        weight[i] = weight[i] > 0 && !(p > 0) ? 1 : weight[i];
        meeting += weight[i];
        before[i] = now[i];
        now[i] = p > 0 ? p : (double)NAN;
    }
    if (full) {
        double(*restrict K_T)[ROW] = X->rate_T[side], *restrict T = X->T[side];
        for (int64_t i = 0; i < n; i++) {
            double change = h * (B_3[0] * K_T[0][i] + B_3[1] * K_T[1][i] + B_3[2] * K_T[2][i]);
            K_T[0][i] = T[i] + change; /* `step_across_port` finds another */
            T[i] = weight[i] > 0 ? T[i] : K_T[0][i];
        }
    }
    return meeting > 0;
}

INLINE void replay_steps(const double *u, const Motions *m, Lanes *W, Sets *X, bool full, int64_t stride,
                         const Plant *plant, double h, const double *psi, int terms, const double *P_s,
                         double *pressure) {
    const double P_0 = plant->conditions.P_0;
    Plant supplied = *plant;
    Constants k = constants_of(&supplied, psi);
    for (int64_t step = 0; step < m->steps; step++) {
        for (int stage = 0; stage < KUTTA_STAGES; stage++) {
            const double now_P_s = P_s[step * KUTTA_STAGES + stage], now_u = u[step * KUTTA_STAGES + stage];
            if (now_P_s != supplied.conditions.P_s) {
                supplied.conditions.P_s = now_P_s;
                k.ln_s = ln(now_P_s / P_0);
            }
            for (int side = 0; side < 2; side++) {
                double x = write_geometry(m, step, stage, side, plant, W->count, X);
                stage_rates(W, X, side, stage, sign_of(side) * now_u, x, full, &k, h, terms);
            }
        }
        const int middle = 1, last = KUTTA_STAGES - 1; /* at the step's end; its supply is still the one in force */
        for (int side = 0; side < 2; side++) {
            const double out_u = sign_of(side) * u[step * KUTTA_STAGES + last];
            const Shared at_end = shared_terms(out_u, 0, 0, side, &k);
            const double p_port = at_end.p_port;
            const double p_port_before = at_end.supplied ? P_s[step * KUTTA_STAGES] / P_0 : p_port;
            if (!step_end(W, X, side, full, p_port, h)) continue;
            double x = write_geometry(m, step, middle, side, plant, W->count, X);
            step_across_port(W, X, side, full, !at_end.supplied, shared_terms(out_u, x, 0, side, &k),
                             p_port_before, &k, h, terms);
            for (int stage = 0; stage < 2; stage++) { /* rates of a stage that failed would stay in later sums */
                memset(W->k[side][stage], 0, sizeof W->k[side][stage]);
                memset(X->rate_T[side][stage], 0, sizeof X->rate_T[side][stage]);
            }
        }
        if ((step + 1) % stride == 0)
            for (int side = 0; side < 2; side++)
                for (int64_t i = 0; i < W->count; i++)
                    pressure[((step + 1) / stride * 2 + side) * W->count + i] = P_0 * W->now[side][i];
    }
}

CLONES void replay_sets(const double *u, const double *motions, int64_t n_motions, int64_t steps, Lanes *W, Sets *X,
                        int64_t width, bool full, double e_A, int64_t stride, const Plant *plant, double h,
                        const double *psi, int terms, const double *P_s, double *pressure) {
    const Motions m = {motions, n_motions, steps, width, e_A};
    if (full) /* no temperature follows from the pressure; every lane has wall heat with the root of P T */
        W->polytropic = W->count, W->heated = W->heated_PT = 0;
    if (terms == 10) replay_steps(u, &m, W, X, full, stride, plant, h, psi, 10, P_s, pressure);
    else if (terms == 14) replay_steps(u, &m, W, X, full, stride, plant, h, psi, 14, P_s, pressure);
    else replay_steps(u, &m, W, X, full, stride, plant, h, psi, 18, P_s, pressure);
}

/* The same for reduced models from given mass flows into the chambers, (step, stage, chamber). */
void replay_flows(const double *motion, const double *flow, int64_t steps, const Lane *lanes, int64_t count,
                  const double *V_d, int64_t stride, const Plant *plant, double h, double *pressure) {
    const Conditions *c = &plant->conditions;
    const int64_t stored = steps / stride + 1;
    for (int64_t i = 0; i < 2 * count; i++) {
        const int side = (int)(i % 2);
        const Lane *lane = lanes + i / 2;
        const Chamber chamber = chamber_of(&plant->cylinder, side);
        const double sign = sign_of(side), beyond = V_d[i] - chamber.V_d;
        double p = pressure[i * stored], K[3] = {0}, rates[2];
        for (int64_t step = 0; step < steps; step++) {
            for (int j = 0; j < KUTTA_STAGES; j++) {
                const double *at = motion + (step * KUTTA_STAGES + j) * 2;
                const double y = p + h * (A_3[j][0] * K[0] + A_3[j][1] * K[1]), x = sign * at[0];
                const double m = flow[(step * KUTTA_STAGES + j) * 2 + side], T = temperature(y, c->P_0, c->T_0, lane->a);
                rates_with_flows(m > 0 ? m : 0, m < 0 ? -m : 0, x, sign * at[1], y, T, chamber, plant, lane, rates);
                const double V = volume(x, chamber, &plant->cylinder);
                K[j] = rates[0] * (V / (V + beyond));
            }
            p += h * (B_3[0] * K[0] + B_3[1] * K[1] + B_3[2] * K[2]);
            if (!(p > 0)) p = (double)NAN;
            if ((step + 1) % stride == 0) pressure[i * stored + (step + 1) / stride] = p;
        }
    }
}

/* Two closed chambers with a moving piston; docstring in pneumo.fitting.closed.closed_problem. */
#include "rates.h"

INLINE double between(const double *series, int64_t j, double at) {
    return series[j] + at * (series[j + 1] - series[j]);
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

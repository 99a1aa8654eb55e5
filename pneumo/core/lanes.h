/* Rates of many lanes side by side, for replay.c and fitted.c. Each loop over lanes becomes vector instructions: rows
   are apart, counts are multiples of WIDTH, branches are selections. Pressures are over P_0; ln(P / P_0) serves both
   the temperature of eq (6) and the pressure ratio of eq (1). A lane outside the range of the polynomials becomes NaN. */
#ifndef PNEUMO_LANES_H
#define PNEUMO_LANES_H
#include "rates.h"

/* Copy a row, of which lanes beyond `n` are not used. */
INLINE void copy_row(double *restrict to, const double *restrict from, int64_t n) {
    for (int64_t i = 0; i < n; i++) to[i] = from[i];
}

/* Terms of the pressure rate at one stage that are the same for all lanes of a chamber. */
typedef struct { double p_port, ln_port, inward, outward, compression, wall, wall_A; bool supplied; } Shared;

/* What does not change during a replay. */
typedef struct {
    const double *psi; /* polynomial of the subsonic flow in ln(P_u / P_d), by `flow_polynomial` */
    double s_sonic, ln_s, ln_atm, root_T_in, inverse_heat_area;
    const Plant *plant;
} Constants;

INLINE Constants constants_of(const Plant *plant, const double *psi) {
    const Conditions *c = &plant->conditions;
    return (Constants){psi, -ln(plant->gas.critical_ratio), ln(c->P_s / c->P_0), ln(c->P_atm / c->P_0),
                       1 / sqrt(c->T_in), 1 / heat_area(0, &plant->cylinder), plant};
}

INLINE Shared shared_terms(double u, double x, double v, int side, const Constants *k) {
    const Plant *plant = k->plant;
    const Conditions *c = &plant->conditions;
    Chamber chamber = chamber_of(&plant->cylinder, side);
    double inverse_V = 1 / volume(x, chamber, &plant->cylinder);
    double throat = plant->gas.R * plant->valve.k_xu * fabs(u) * inverse_V; /* (2) */
    if (u < 0) throat *= plant->valve.exhaust;
    bool supplied = u >= 0;
    if (plant->valve.paths.knots > 0) { /* with one critical ratio, and never both paths open */
        supplied = path_area(u, side, 0, &plant->valve) > 0;
        throat = plant->gas.R * path_area(u, side, !supplied, &plant->valve) * inverse_V;
    }
    double p_port = (supplied ? c->P_s : c->P_atm) / c->P_0;
    double wall = (plant->gas.gamma - 1) * plant->k_0 / c->P_0 * inverse_V;
    return (Shared){p_port, supplied ? k->ln_s : k->ln_atm, throat * (p_port * k->root_T_in), -throat,
                    -chamber.area * v * inverse_V, wall,
                    wall * (heat_area(x, &plant->cylinder) * k->inverse_heat_area), supplied};
}

/* Write the rate of every lane's pressure, P_0 per second. W->p holds the pressures, W->root_T the roots of T / T_0
   where they do not follow from them. */
INLINE void write_rates(Lanes *restrict W, double *restrict rate, const Shared sh, const Constants *k, int terms) {
    const int64_t n = W->count;
    const double T_0 = k->plant->conditions.T_0, T_amb = k->plant->conditions.T_amb;
    const double sonic = k->plant->gas.sonic_coefficient, s_sonic = k->s_sonic;
    double psi[18];
    for (int i = 0; i < terms; i++) psi[i] = k->psi[i];
    for (int64_t i = 0; i < n; i++) W->ln_p[i] = fast_log(W->p[i]);
    for (int64_t i = W->polytropic; i < n; i++) W->root_T[i] = fast_exp(W->a_half[i] * W->ln_p[i]); /* (6) */
    for (int64_t i = W->heated; i < n; i++) {
        double T = T_0 * (W->root_T[i] * W->root_T[i]);
        W->heat[i] = (sh.wall * W->wall[i] + sh.wall_A * W->wall_A[i]) * (T_amb - T); /* (13), (11) */
    }
    for (int64_t i = W->heated_PT; i < n; i++) {
        double T = T_0 * (W->root_T[i] * W->root_T[i]);
        W->heat[i] += sh.wall_A * W->wall_APT[i] * sqrt(W->p[i]) * W->root_T[i] * (T_amb - T); /* (7), (8) */
    }
    for (int64_t i = 0; i < n; i++) {
        double p = W->p[i], root_T = W->root_T[i], s = fabs(W->ln_p[i] - sh.ln_port);
        double subsonic = sqrt(s) * polynomial(psi, terms, s);
        double flow = s >= s_sonic ? sonic : subsonic; /* (1) */
        double inflow = sh.inward * (W->in[i] + W->in_T[i] * (root_T * root_T));
        double outflow = (sh.outward * p) * (W->out[i] * root_T);
        double energy = sh.p_port >= p ? inflow : outflow;
        rate[i] = (sh.compression * p) * W->n_V[i] + (flow * energy + W->heat[i]);
    }
}
#endif

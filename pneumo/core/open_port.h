/* Steps near the pressure of an open port, where the slope of eq (1) is infinite and explicit steps chatter. Of such a
   flow's term in dP/dt, K sqrt(d), the factor K hardly changes with the distance d from the port's pressure, and an
   implicit equation that is linear in sqrt(d) is quadratic: its root never lies beyond the port's pressure. Two such
   stages make the L-stable method of second order of Alexander (1977), doi:10.1137/0714068. */
#ifndef PNEUMO_OPEN_PORT_H
#define PNEUMO_OPEN_PORT_H
#include "rates.h"

#define GAMMA (1 - 0.70710678118654752) /* of a step: time of the first stage, and implicit weight in both */
/* An explicit step that comes nearer to the port's pressure than a quarter of (h K)^2 is inaccurate and soon unstable;
   nearer than this fraction of that pressure, it is negligible. */
#define NEAR 1e-8
enum { MOST_ROUNDS = 50 }; /* to solve the equation of a stage */
#define SOLVED 1e-11 /* relative change in a round, below which it is solved */

/* Solution d of d + hK sign(d) sqrt(|d|) = rest. */
INLINE double balanced(double rest, double hK) {
    double y = (sqrt(hK * hK + 4 * fabs(rest)) - hK) / 2;
    return rest > 0 ? y * y : -(y * y);
}

/* Whether a pressure that goes from P through `later` comes too near to an open port for an explicit step. */
INLINE bool near_port(double u, double x, double P, double T, const double *later, int64_t count, int64_t apart, double h,
                      Chamber chamber, const Plant *plant) {
    const Conditions *c = &plant->conditions;
    for (int port = 0; port < 2; port++) {
        const double A_t = path_area(u, chamber.side, port, &plant->valve), P_port = port == 0 ? c->P_s : c->P_atm;
        if (A_t == 0 || plant->valve.net_leak) continue;
        const Gas gas = path_gas(chamber.side, port, plant);
        const bool fills = P_port > P;
        const double T_u = fills ? c->T_in : T, V = volume(x, chamber, &plant->cylinder);
        const double sonic = gas.gamma * gas.R * T_u * choked_flow(A_t, 1, T_u, &gas) / V; /* rate of P over P_u */
        const double hK = h * sonic * sqrt(2 / (1 - gas.critical_ratio) * larger(P, P_port)), reach = hK * hK / 4;
        double margin = fabs(P_port - P);
        for (int64_t i = 0; i < count; i++) {
            const double d = fills ? P_port - later[i * apart] : later[i * apart] - P_port;
            margin = d >= margin ? margin : d; /* NaN of a stage that failed stays */
        }
        if (!(margin >= reach) && reach > NEAR * P_port) return true;
    }
    return false;
}

/* Where a step led the piston beyond a stop, to x, undo the compression that this caused, as the piston is put back. */
INLINE void put_back(double *y, double x, Chamber chamber, const Plant *plant) {
    const Cylinder *c = &plant->cylinder;
    const double sign = sign_of(chamber.side), x_stop = larger(c->x_min, smaller(x, c->x_max));
    if (!(fabs(x - x_stop) > 0)) return;
    const double compressed = power(volume(sign * x, chamber, c) / volume(sign * x_stop, chamber, c), plant->gas.gamma - 1);
    y[0] *= compressed * volume(sign * x, chamber, c) / volume(sign * x_stop, chamber, c);
    y[1] *= compressed;
}

/* One chamber of the full order in one such step; positions and velocities are counted outward from it. */
typedef struct { double u, x, v, h; Chamber chamber; const Plant *plant; } Filling;

/* Solve P = base + weight dP/dt. T is that of the mass in the chamber: `mass`, and what flows in at the rate m during
   `weight` seconds. Return whether a solution was found. */
INLINE bool solve_stage(const Filling *of, double base, double mass, double weight, double *P, double *T, double *m) {
    const Plant *plant = of->plant;
    const Conditions *c = &plant->conditions;
    const Valve *valve = &plant->valve;
    const Lane lane = full_order(plant->gas.gamma);
    const double V = volume(of->x, of->chamber, &plant->cylinder), pressure[2] = {c->P_s, c->P_atm};
    const double area[2] = {path_area(of->u, of->chamber.side, 0, valve), path_area(of->u, of->chamber.side, 1, valve)};
    /* If both are open, the equation is that of the port where the flow changes more with the pressure. */
    const int near = area[0] * area[0] * fabs(*P - c->P_atm) < area[1] * area[1] * fabs(c->P_s - *P), far = 1 - near;
    const Gas gas = path_gas(of->chamber.side, near, plant), gas_far = path_gas(of->chamber.side, far, plant);
    const double P_port = pressure[near];
    bool fills = P_port > *P;
    for (int round = 0; round < MOST_ROUNDS; round++) {
        double m_in, m_out, far_in, far_out, rates[2];
        const double d_before = larger(fills ? P_port - *P : *P - P_port, NEAR * P_port);
        port_flows(area[near], P_port, fills ? P_port - d_before : P_port + d_before, *T, valve, &gas, c, &m_in, &m_out);
        port_flows(area[far], pressure[far], *P, *T, valve, &gas_far, c, &far_in, &far_out);
        rates_with_flows(far_in, far_out, of->x, of->v, *P, *T, of->chamber, plant, &lane, rates);
        const double rest = P_port - base - weight * rates[0];
        if ((rest > 0) != fills) {
            fills = rest > 0;
            *P = P_port;
            continue;
        }
        const double energy = lane.n_in * plant->gas.R * (fills ? c->T_in : *T) / V;
        const double d = balanced(rest, weight * energy * (m_in + m_out) / sqrt(d_before));
        *m = (m_in - m_out) * sqrt(fabs(d) / d_before) + far_in - far_out;
        const double P_new = P_port - d, T_new = P_new * V / (plant->gas.R * (mass + weight * *m));
        const double change = larger(fabs(P_new - *P) / P_port, fabs(T_new - *T) / c->T_0);
        *P = P_new;
        *T = T_new;
        if (change < SOLVED) return *P > 0 && *T > 0;
    }
    return false;
}

/* Advance y = (P, T) of a chamber whose piston moves uniformly from `of->x`; u is `u_first` at the first stage. Return
   the larger estimated error over P_0 and T_0, infinite where the step failed. */
INLINE double implicit_step(double *y, const Filling *of, double u_first) {
    const Conditions *c = &of->plant->conditions;
    const double P = y[0], T = y[1], h = of->h, w = GAMMA * h;
    const double mass = P * volume(of->x, of->chamber, &of->plant->cylinder) / (of->plant->gas.R * T);
    Filling at = *of;
    double m;
    at.u = u_first;
    at.x = of->x + w * of->v;
    if (!solve_stage(&at, P, mass, w, y, y + 1, &m)) return (double)INFINITY;
    const double first[2] = {y[0] - P, y[1] - T};
    at.u = of->u;
    at.x = of->x + h * of->v;
    if (!solve_stage(&at, P + (1 / GAMMA - 1) * first[0], mass + (h - w) * m, w, y, y + 1, &m)) return (double)INFINITY;
    /* what a method of first order, whose rate is that of the first stage, would change */
    return larger(fabs(y[0] - P - first[0] / GAMMA) / c->P_0, fabs(y[1] - T - first[1] / GAMMA) / c->T_0);
}
#endif

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

/* Mass flow over the square root of P_u - P_d, where both are nearly equal, by eq (1) or ISO 6358. */
INLINE double flow_over_root(double A_t, double P_u, double T_u, const Gas *gas) {
    if (gas->elliptic) return choked_flow(A_t, P_u, T_u, gas) * sqrt(2 / ((1 - gas->critical_ratio) * P_u));
    return A_t * sqrt(2 * P_u / (gas->R * T_u));
}

/* Pressure after such a step in which the rest of the rate, b, and K hardly change: `in` and `out` are GAMMA h K for a
   flow into the chamber and out of it. The port's pressure at the first stage is `port_then`, that of the chamber `first`. */
INLINE double step_with_factors(double p, double port_then, double port, double hb, double in, double out, double *first) {
    double rest = port_then - p - GAMMA * hb, d = balanced(rest, rest > 0 ? in : out);
    *first = port_then - d;
    rest = port - p - hb + (1 / GAMMA - 1) * (d - rest);
    return port - balanced(rest, rest > 0 ? in : out);
}

/* Error of that step: that of a method of first order, and that of a K which is not quite constant; -1 if neither end is
   near the port. `explicitly` is the pressure after an explicit step. */
INLINE double error_with_factors(double p, double explicitly, double end, double first, double port, double in, double out) {
    const double hK = larger(in, out) / GAMMA, reach = hK * hK / 4;
    const double d = fabs(port - p), d_end = p > port ? explicitly - port : port - explicitly;
    if ((d >= reach && d_end >= reach) || !(reach > NEAR * port)) return -1;
    const double off = fabs(end - p - (first - p) / GAMMA), way = larger(d, fabs(port - end)) / port;
    return off + way * fabs(end - p);
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
        const double m = flow_over_root(A_t, larger(P, P_port), T_u, &gas);
        const double hK = h * gas.gamma * gas.R * T_u * m / V, reach = hK * hK / 4;
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
    const Lane lane = full_order(plant);
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

/* Valve, piston and chamber, eqs (1) to (8) and (10): what pneumo/physics says, for the loops of the core.
   tests/core compare the two. For chamber B, u, x and v are negated. */
#ifndef PNEUMO_RATES_H
#define PNEUMO_RATES_H
#include "maths.h"

typedef struct { double area, V_d; int side; } Chamber;

INLINE Chamber chamber_of(const Cylinder *c, int side) {
    return side == 0 ? (Chamber){c->A_A, c->V_d_A, 0} : (Chamber){c->A_B, c->V_d_B, 1};
}
INLINE double sign_of(int side) { return side == 0 ? 1.0 : -1.0; }
INLINE double volume(double x, Chamber chamber, const Cylinder *c) {
    return chamber.V_d + chamber.area * (c->stroke / 2 + x);
}
INLINE double heat_area(double x, const Cylinder *c) {
    return PI / 2 * (c->bore * c->bore) + fabs(PI * c->bore * (x + c->stroke / 2));
}
INLINE double limited(double u, double u_max) { return u < -u_max ? -u_max : u > u_max ? u_max : u; }

/* Coefficients of the full order, eqs (4), (5), (7) and (8). */
INLINE Lane full_order(const Plant *plant) {
    const double gamma = plant->gas.gamma;
    return (Lane){gamma, gamma, gamma, 0, 1, 1, 1, plant->wall.e_A, plant->wall.e_PT, 1};
}

INLINE double choked_flow(double A_t, double P_u, double T_u, const Gas *gas) {
    return gas->sonic_coefficient * P_u * A_t / sqrt(T_u);
}

INLINE double subsonic_flow(double A_t, double P_u, double ratio, double T_u, const Gas *gas) {
    double g = gas->gamma, s = larger(normal_ln(ratio, 0), -300); /* far below any critical ratio */
    double s_g = s / g, subsonic = finite_exp(2 * s_g) - finite_exp(s + s_g);
    subsonic = subsonic < 0 ? 0 : subsonic; /* by rounding, where the pressures are equal but for the last digit */
    return A_t * P_u * sqrt(2 * g / ((g - 1) * gas->R * T_u) * subsonic); /* (1) */
}

INLINE double mass_flow(double A_t, double P_u, double P_d, double T_u, const Gas *gas) {
    double ratio = P_d / P_u, b = gas->critical_ratio;
    if (ratio <= b) return choked_flow(A_t, P_u, T_u, gas);
    if (gas->elliptic) {
        double above = (ratio - b) / (1 - b);
        return choked_flow(A_t, P_u, T_u, gas) * sqrt(1 - above * above); /* ISO 6358 */
    }
    return subsonic_flow(A_t, P_u, ratio, T_u, gas);
}

INLINE double laminar_factor(double P_u, double P_d, double laminar) {
    double difference = 1 - P_d / P_u;
    return difference < laminar ? sqrt(difference / laminar) : 1.0;
}

INLINE void port_flows(double A_t, double P_port, double P, double T, const Valve *valve, const Gas *gas,
                       const Conditions *c, double *m_in, double *m_out) {
    *m_in = *m_out = 0;
    if (P_port >= P) {
        if (valve->laminar > 0) A_t *= laminar_factor(P_port, P, valve->laminar);
        *m_in = mass_flow(A_t, P_port, P, c->T_in, gas);
    } else {
        if (valve->laminar > 0) A_t *= laminar_factor(P, P_port, valve->laminar);
        *m_out = mass_flow(A_t, P, P_port, T, gas);
    }
}

/* Opening at a chamber's own command: linear between knots, and that of the last knot beyond. */
INLINE double opening_at(double u, const double *knots, const double *openings, int64_t count) {
    if (!(u > knots[0])) return openings[0];
    for (int64_t i = 1; i < count; i++)
        if (u <= knots[i])
            return openings[i - 1] + (u - knots[i - 1]) / (knots[i] - knots[i - 1]) * (openings[i] - openings[i - 1]);
    return openings[count - 1];
}

/* Area of a chamber's path from the supply, port 0, or to the atmosphere, port 1, at its own command. */
INLINE double path_area(double u, int side, int port, const Valve *valve) {
    const Paths *paths = &valve->paths;
    if (paths->knots > 0) {
        const double *openings = port == 0 ? paths->supply[side] : paths->exhaust[side];
        return valve->k_xu * opening_at(u, paths->u, openings, paths->knots) + valve->leak;
    }
    if ((port == 0) != (u >= 0)) return valve->leak;
    return valve->k_xu * fabs(u) * (port == 0 ? 1.0 : valve->exhaust) + valve->leak; /* (2) */
}

INLINE Gas path_gas(int side, int port, const Plant *plant) {
    Gas gas = plant->gas;
    if (plant->valve.paths.b[side][port] > 0) gas.critical_ratio = plant->valve.paths.b[side][port];
    return gas;
}

INLINE void chamber_flows(double u, double P, double T, int side, const Plant *plant, double *m_in, double *m_out) {
    const Conditions *c = &plant->conditions;
    *m_in = *m_out = 0;
    for (int port = 0; port < 2; port++) {
        const double area = path_area(u, side, port, &plant->valve);
        double inward, outward;
        if (area == 0) continue;
        const Gas gas = path_gas(side, port, plant);
        port_flows(area, port == 0 ? c->P_s : c->P_atm, P, T, &plant->valve, &gas, c, &inward, &outward);
        *m_in += inward;
        *m_out += outward;
    }
    if (plant->valve.net_leak) {
        double net = *m_in - *m_out;
        *m_in = larger(net, 0);
        *m_out = larger(-net, 0);
    }
}

INLINE double wall_conductance(double k_0, double area_ratio, double PT_ratio, double e_A, double e_PT) {
    return k_0 * power(area_ratio, e_A) * power(PT_ratio, e_PT); /* (8) */
}

INLINE double temperature(double P, double P_0, double T_0, double a) { return T_0 * power(P / P_0, a); } /* (6) */

INLINE double dP_dt(double P, double T, double V, double dV_dt, double m_in, double m_out, double T_inlet, double heat,
                    double n_V, double n_in, double n_out, double R, double gamma) {
    return (-n_V * P * dV_dt + R * (n_in * m_in * T_inlet - n_out * m_out * T) + (gamma - 1) * heat) / V; /* (4), (10) */
}

/* Eq (5), from the rate of pressure and P V = m R T. */
INLINE double dT_dt(double P, double T, double V, double dV_dt, double m_in, double m_out, double dP_dt, double R) {
    return T * (dP_dt * V + P * dV_dt - (m_in - m_out) * R * T) / (P * V);
}

/* Rates of pressure and temperature from known mass flows; a reduced model has no rate of temperature. */
INLINE void rates_with_flows(double m_in, double m_out, double x, double v, double P, double T, Chamber chamber,
                             const Plant *plant, const Lane *lane, double *rates) {
    const Conditions *c = &plant->conditions;
    const double R = plant->gas.R, gamma = plant->gas.gamma;
    double V = volume(x, chamber, &plant->cylinder), dV_dt = chamber.area * v, heat = 0;
    m_in *= lane->flow_scale;
    m_out *= lane->flow_scale;
    if (lane->wall_scale != 0) {
        double area_ratio = heat_area(x, &plant->cylinder) / heat_area(0, &plant->cylinder);
        double k = wall_conductance(plant->k_0, area_ratio, P * T / (c->P_0 * c->T_0), lane->e_A, lane->e_PT);
        heat = lane->wall_scale * (k * (c->T_amb - T)); /* (7), (11), (13) */
    }
    double T_inlet = lane->mixing * c->T_in + (1 - lane->mixing) * T;
    rates[0] = dP_dt(P, T, V, dV_dt, m_in, m_out, T_inlet, heat, lane->n_V, lane->n_in, lane->n_out, R, gamma);
    rates[1] = lane->full != 0 ? dT_dt(P, T, V, dV_dt, m_in, m_out, rates[0], R) : 0;
}

/* Rates of pressure and temperature by the full order or, where T follows from P by eq (6), a reduced model. */
INLINE void chamber_rates(double u, double x, double v, double P, double T, Chamber chamber, const Plant *plant,
                          const Lane *lane, double *rates) {
    double m_in, m_out;
    if (lane->full == 0) T = temperature(P, plant->conditions.P_0, plant->conditions.T_0, lane->a);
    chamber_flows(u, P, T, chamber.side, plant, &m_in, &m_out);
    rates_with_flows(m_in, m_out, x, v, P, T, chamber, plant, lane, rates);
}

INLINE double beyond_coulomb(double F, double v, double coulomb) {
    if (v == 0 && fabs(F) <= coulomb) return 0;
    return v > 0 || (v == 0 && F > 0) ? F - coulomb : F + coulomb;
}

INLINE double acceleration(double x, double v, double P_A, double P_B, double force, const Cylinder *c) {
    double F = P_A * c->A_A - P_B * c->A_B - c->k_f * v + force + c->load - c->spring * x;
    if (c->coulomb != 0) F = beyond_coulomb(F, v, c->coulomb);
    return F / c->M; /* (3) */
}

INLINE void motion(double x, double v, double a, const Cylinder *c, double *dx_dt, double *dv_dt) {
    bool pushed = (x == c->x_min && a < 0) || (x == c->x_max && a > 0);
    bool held = c->rests && v == 0 && pushed;
    *dx_dt = held ? 0 : v;
    *dv_dt = held ? 0 : a;
}

INLINE void stopped(double *x, double *v, double v_before, const Cylinder *c) {
    if (c->coulomb != 0 && *v * v_before < 0) *v = 0;
    if (*x <= c->x_min) {
        *x = c->x_min;
        *v = larger(0, *v);
    } else if (*x >= c->x_max) {
        *x = c->x_max;
        *v = smaller(0, *v);
    }
}

/* Command to the valve before its limiter, Figs 4 and 5. */
INLINE double command(double reference, double x, const Drive *drive) {
    if (drive->closed_loop) return drive->k_p * (reference - x);
    if (!drive->each_stage) return reference;
    if (x >= drive->x_reverse) return -fabs(reference);
    if (x <= -drive->x_reverse) return fabs(reference);
    return reference;
}

/* Dormand and Prince's fifth-order method of six stages, and its error estimate with a seventh at the end. */
#define STEP_TOLERANCE 1e-4 /* error over P_0, T_0 or the stroke above which a step is halved */
static const double A[6][5] = {{0},
                               {1.0 / 5},
                               {3.0 / 40, 9.0 / 40},
                               {44.0 / 45, -56.0 / 15, 32.0 / 9},
                               {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
                               {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656}};
static const double B[6] = {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84};
static const double C[7] = {0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1, 1};
static const double E[7] = {71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40};

typedef void (*Rates)(const double *y, int stage, const void *context, double *dy);

/* Write the state h later into y_next, which may be y, the stage states into Y and their rates into K. */
INLINE void dormand_prince(Rates rates, const void *context, const double *y, int64_t size, double h, double *Y,
                           double *K, double *y_next) {
    for (int i = 0; i < STAGES; i++) {
        double *restrict at = Y + i * size;
        for (int64_t s = 0; s < size; s++) at[s] = 0;
        for (int j = 0; j < i; j++) /* the order of loops that becomes vector instructions */
            for (int64_t s = 0; s < size; s++) at[s] += A[i][j] * K[j * size + s];
        for (int64_t s = 0; s < size; s++) at[s] = y[s] + h * at[s];
        rates(Y + i * size, i, context, K + i * size);
    }
    for (int64_t s = 0; s < size; s++) {
        double total = 0;
        for (int i = 0; i < STAGES; i++) total += B[i] * K[i * size + s];
        y_next[s] = y[s] + h * total;
    }
}

/* Write the estimated errors of such a step into `error`; the rates at its end go into the seventh row of K. */
INLINE void embedded_error(Rates rates, const void *context, const double *y_next, int64_t size, double h, double *K,
                           double *error) {
    rates(y_next, STAGES, context, K + STAGES * size);
    for (int64_t s = 0; s < size; s++) {
        double total = 0;
        for (int i = 0; i <= STAGES; i++) total += E[i] * K[i * size + s];
        error[s] = h * total;
    }
}

/* full_order.c */
typedef struct { double reference, force; const Drive *drive; const Plant *plant; const double *u_B; } Driven;
bool stage_inputs(const Recording *recording, const Sampling *sampling, int64_t k, int part, int parts, double *y,
                  double inputs[7][4]);
double replay_tolerance(const Sampling *sampling);
#endif

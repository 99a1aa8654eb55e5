/* The rig of bench_rig.py, stepped by the classical Runge-Kutta method: a second statement of the physics, which
   shares no code with pneumo. All quantities are in SI units. */
#include <math.h>

static const double R = 287.0, C_V = 717.5, C_P = 1004.5; /* of air, J/(kg K) */
static const double RHO_REF = 1.185, T_REF = 293.15;      /* reference atmosphere of ISO 6358 */
static const double PI = 3.14159265358979323846, P_ATM = 101325.0, U_MAX = 10.0;
static const double LAMINAR = 0.999; /* pressure ratio above which flow is proportional to the pressure difference */
static const double STOP_STIFFNESS = 1e6, STOP_DAMPING = 1e3; /* N/m, N s/m */
static const double STICTION = 1e-3; /* m/s, speed below which Coulomb friction falls to zero */
static const double STRIBECK = 0.02; /* m/s, speed at which static friction has gone */
static const double CAPACITY = 5e-4; /* m^3, of the line behind a weak supply */

typedef struct { /* as `Rig` in bench_rig.py */
    double bore, rod, stroke, mass, coulomb, viscous, C, b, k_0, V_A, V_B, P_s, P_0, T_amb, exhaust, lag, dead_time,
        null, weak_supply, e_A, e_PT, side_B, dead_band, hysteresis, piston_leak, valve_leak, warming, inlet, stick, bend;
} Rig;

static double greater(double a, double b) { return a > b ? a : b; }
static double lesser(double a, double b) { return a < b ? a : b; }

/* ISO 6358: mass flow from P_1 to the lower P_2. */
static double flow(double C, double b, double P_1, double P_2, double T_1) {
    double sonic = C * RHO_REF * P_1 * sqrt(T_REF / T_1), ratio = P_2 / P_1, beyond = (LAMINAR - b) / (1 - b);
    if (ratio <= b) return sonic;
    if (ratio > LAMINAR) return sonic * sqrt(1 - beyond * beyond) * (1 - ratio) / (1 - LAMINAR);
    beyond = (ratio - b) / (1 - b);
    return sonic * sqrt(1 - beyond * beyond);
}

/* Opening of the valve at rest, -1 to 1, at a command. */
static double spool_at(double u, const Rig *rig) {
    double beyond = u - rig->null, opening = greater(fabs(beyond) - rig->dead_band, 0) / U_MAX;
    return (opening + 4 * rig->bend * opening * (1 - opening)) * (beyond > 0 ? 1.0 : -1.0);
}

/* Mass flow from 1 to 2, negative where it goes back. */
static double through(double C, double b, double P_1, double P_2, double T_1, double T_2) {
    return P_1 >= P_2 ? flow(C, b, P_1, P_2, T_1) : -flow(C, b, P_2, P_1, T_2);
}

static double area_of(const Rig *rig, int side) {
    double area = PI / 4 * (rig->bore * rig->bore);
    return side == 0 ? area : area - PI / 4 * (rig->rod * rig->rod);
}

/* Rates of x, v, opening, supply pressure, and mass and internal energy of the air in A and B. */
static void rates(const double *y, double u, double time, const Rig *rig, double *dy) {
    double x = y[0], v = y[1], opening = y[2], P_s = y[3], T_amb = rig->T_amb + rig->warming * time, P[2], T[2];
    double T_in = T_amb + rig->inlet, static_part = rig->stick * exp(-v * v / (STRIBECK * STRIBECK));
    double wall_mid = PI / 2 * (rig->bore * rig->bore) + PI * rig->bore * rig->stroke / 2;
    double drawn = 0, force = -P_ATM * (area_of(rig, 0) - area_of(rig, 1));
    for (int side = 0; side < 2; side++) {
        double sign = 1.0 - 2.0 * side, dead = side == 0 ? rig->V_A : rig->V_B, area = area_of(rig, side);
        double reach = rig->stroke / 2 + sign * x, V = dead + area * reach, m = y[4 + 2 * side];
        T[side] = y[5 + 2 * side] / (m * C_V);
        P[side] = m * R * T[side] / V;
        double gain = rig->C * fabs(opening) * (side == 0 ? 1.0 : rig->side_B);
        double from_supply = rig->valve_leak * rig->C + (sign * opening >= 0 ? gain : 0);
        double to_exhaust = rig->valve_leak * rig->C + (sign * opening < 0 ? rig->exhaust * gain : 0);
        double fed = through(from_supply, rig->b, P_s, P[side], T_in, T[side]);
        double vented = through(to_exhaust, rig->b, P[side], P_ATM, T[side], T_amb);
        drawn += fed;
        double enthalpy = C_P * (fed * (fed > 0 ? T_in : T[side]) - vented * (vented > 0 ? T[side] : T_amb));
        double wall = PI / 2 * (rig->bore * rig->bore) + PI * rig->bore * reach;
        double k = rig->k_0 * pow(wall / wall_mid, rig->e_A) * pow(P[side] * T[side] / (rig->P_0 * rig->T_amb), rig->e_PT);
        dy[4 + 2 * side] = fed - vented;
        dy[5 + 2 * side] = enthalpy + k * (T_amb - T[side]) - P[side] * sign * area * v;
        force += sign * P[side] * area;
    }
    if (rig->piston_leak > 0) {
        double leak = through(rig->piston_leak * rig->C, rig->b, P[0], P[1], T[0], T[1]);
        double enthalpy = C_P * leak * (leak > 0 ? T[0] : T[1]);
        dy[4] -= leak;
        dy[5] -= enthalpy;
        dy[6] += leak;
        dy[7] += enthalpy;
    }
    double beyond = greater(x - rig->stroke / 2, 0) + lesser(x + rig->stroke / 2, 0);
    if (beyond != 0) force -= STOP_STIFFNESS * beyond + STOP_DAMPING * v;
    dy[0] = v;
    dy[1] = (force - rig->coulomb * (1 + static_part) * tanh(v / STICTION) - rig->viscous * v) / rig->mass;
    dy[2] = rig->lag > 0 ? (spool_at(u, rig) - opening) / rig->lag : 0;
    dy[3] = 0;
    if (rig->weak_supply > 0) {
        double feed = rig->P_s > P_s ? flow(rig->weak_supply * rig->C, rig->b, rig->P_s, P_s, T_amb) : 0;
        dy[3] = R * T_amb / CAPACITY * (feed - drawn);
    }
}

/* Follow a target of every control period in so many steps each; rows of u, x, P_A, P_B, P_s, v at their start. With a
   gain of 0 the target is the command, which only points inward while the piston is beyond `reverse` from the centre. */
void bench_run(const Rig *rig, const double *target, long count, double gain, double reverse, long late, double period,
               long steps, double step, double *sent, double *rows) {
    double y[8] = {0}, dy[4][8], trial[8], spool = 0;
    const double parts[4] = {0.0, 0.5, 0.5, 1.0};
    y[3] = rig->P_s;
    for (int side = 0; side < 2; side++) {
        double dead = side == 0 ? rig->V_A : rig->V_B;
        y[4 + 2 * side] = rig->P_0 * (dead + area_of(rig, side) * rig->stroke / 2) / (R * rig->T_amb);
        y[5 + 2 * side] = y[4 + 2 * side] * C_V * rig->T_amb;
    }
    for (long n = 0; n < count; n++, rows += 6) {
        for (int side = 0; side < 2; side++) {
            double sign = 1.0 - 2.0 * side, dead = side == 0 ? rig->V_A : rig->V_B;
            rows[2 + side] = y[5 + 2 * side] * (R / C_V) / (dead + area_of(rig, side) * (rig->stroke / 2 + sign * y[0]));
        }
        sent[n] = gain > 0 ? gain * (target[n] - y[0]) : fabs(y[0]) < reverse ? target[n] : -copysign(target[n], y[0]);
        sent[n] = lesser(greater(sent[n], -U_MAX), U_MAX);
        rows[0] = sent[n];
        rows[1] = y[0];
        rows[4] = y[3];
        rows[5] = y[1];
        double u = sent[n > late ? n - late : 0];
        spool = lesser(greater(spool, u - rig->hysteresis), u + rig->hysteresis);
        if (rig->lag == 0) y[2] = spool_at(spool, rig);
        for (long k = 0; k < steps; k++) {
            for (int stage = 0; stage < 4; stage++) {
                for (int s = 0; s < 8; s++) trial[s] = stage > 0 ? y[s] + parts[stage] * step * dy[stage - 1][s] : y[s];
                rates(trial, spool, (double)n * period + (double)k * step, rig, dy[stage]);
            }
            for (int s = 0; s < 8; s++) y[s] += step / 6 * (dy[0][s] + 2 * dy[1][s] + 2 * dy[2][s] + dy[3][s]);
        }
    }
}

/* Runs of the full order, and what each Runge-Kutta stage of a replay reads of their signals. */
#include <float.h>

#include "open_port.h"

double LOG_TABLE[STEPS + 2][2], EXP_TABLE[STEPS];

void fill_tables(void) {
    for (int i = 0; i < STEPS + 2; i++) {
        double c = from_bits((FIRST_C + (uint64_t)i) << SEVEN_BITS);
        LOG_TABLE[i][0] = c == 1 ? 0 : plain_ln(c);
        LOG_TABLE[i][1] = 1 / c;
    }
    for (int j = 0; j < STEPS; j++) {
        double t = j * (LN_2_HIGH / STEPS), low = j * (LN_2_LOW / STEPS); /* the first is exact */
        double rest = 0, sum = 1 + t;
        for (int n = 20; n > 1; n--) rest = t / n * (1 + rest); /* exp(t) = 1 + t (1 + rest) */
        EXP_TABLE[j] = sum + ((t - (sum - 1)) + (t * rest + low * (sum + t * rest)));
    }
}

double core_log(double x) { return ln(x); }
double core_exp(double x) { return exponential(x); }
double core_pow(double x, double y) { return power(x, y); }

void chamber_rate(double u, double x, double v, double P, double T, int side, const Plant *plant, const Lane *lane,
                  double *rates) {
    double sign = sign_of(side);
    chamber_rates(sign * u, sign * x, sign * v, P, T, chamber_of(&plant->cylinder, side), plant, lane, rates);
}

/* Limited command of chamber B's own valve, or, on a valve that both chambers share, the negative of chamber A's. */
INLINE double own_command_of_B(double u, const double *u_B, double u_max) { return u_B ? limited(*u_B, u_max) : -u; }

/* Eq (3), and eqs (4) and (5) for both chambers. */
INLINE void full_order_rates(const double *y, int stage, const void *context, double *dy) {
    const Driven *d = context;
    const Plant *plant = d->plant;
    const Cylinder *c = &plant->cylinder;
    const Lane lane = full_order(plant);
    (void)stage;
    double u = limited(command(d->reference, y[0], d->drive), plant->valve.u_max);
    motion(y[0], y[1], acceleration(y[0], y[1], y[2], y[4], d->force, c), c, dy, dy + 1);
    chamber_rates(u, y[0], y[1], y[2], y[3], chamber_of(c, 0), plant, &lane, dy + 2);
    double u_B = own_command_of_B(u, d->u_B, plant->valve.u_max);
    chamber_rates(u_B, -y[0], -y[1], y[4], y[5], chamber_of(c, 1), plant, &lane, dy + 4);
}

/* Advance the state y by one step; the stage states and the state before the stops go into Y, 7 rows of 6. */
INLINE void full_order_step(double *y, const Driven *driven, double h, double *Y, double *K) {
    double v = y[1];
    dormand_prince(full_order_rates, driven, y, 6, h, Y, K, Y + 36);
    memcpy(y, Y + 36, 6 * sizeof *y);
    stopped(y, y + 1, v, &driven->plant->cylinder);
}

/* Largest estimated error of the last step over stroke, P_0 or T_0; infinite where it failed. The way beyond a stop is
   an error of the position. */
static double relative_error(const Driven *driven, double h, const double *y, double *K) {
    const Plant *plant = driven->plant;
    double error[6];
    embedded_error(full_order_rates, driven, y, 6, h, K, error);
    const Cylinder *c = &plant->cylinder;
    double largest = larger(fabs(error[0]), larger(c->x_min - y[0], y[0] - c->x_max)) / c->stroke;
    for (int s = 2; s < 6; s++) {
        double scale = s % 2 == 0 ? plant->conditions.P_0 : plant->conditions.T_0;
        if (!(y[s] > 0 && fabs(error[s]) < INFINITY)) return (double)INFINITY;
        largest = larger(largest, fabs(error[s]) / scale);
    }
    return largest;
}

/* Advance y across or near an open port's pressure; the piston moves with constant acceleration, and the stages'
   positions and velocities go into Y. Return the largest estimated error, as `relative_error` does. */
static double step_near_port(double *y, const Driven *driven, double h, double *Y) {
    const Plant *plant = driven->plant;
    const Cylinder *c = &plant->cylinder;
    const double x = y[0], v = y[1], u_max = plant->valve.u_max;
    double dx, dv, dv_end, largest = 0;
    motion(x, v, acceleration(x, v, y[2], y[4], driven->force, c), c, &dx, &dv);
    const double x_free = x + h * (dx + h / 2 * dv), x_end = larger(c->x_min, smaller(x_free, c->x_max));
    const double speed = (x_end - x) / h, bend = 2 * (speed - dx) / h;
    for (int i = 0; i <= STAGES; i++) {
        Y[6 * i] = x + h * C[i] * (dx + h * C[i] / 2 * bend);
        Y[6 * i + 1] = dx + h * C[i] * bend;
    }
    const double u_first = limited(command(driven->reference, x + GAMMA * h * speed, driven->drive), u_max);
    const double u_end = limited(command(driven->reference, x_end, driven->drive), u_max);
    for (int side = 0; side < 2; side++) {
        const double sign = sign_of(side);
        const double first = side ? own_command_of_B(u_first, driven->u_B, u_max) : u_first;
        const double end = side ? own_command_of_B(u_end, driven->u_B, u_max) : u_end;
        const Filling filling = {end, sign * x, sign * speed, h, chamber_of(c, side), plant};
        largest = larger(largest, implicit_step(y + 2 + 2 * side, &filling, first));
    }
    motion(x_end, v + h * dv, acceleration(x_end, v + h * dv, y[2], y[4], driven->force, c), c, &dx, &dv_end);
    y[0] = x_end;
    y[1] = v + h / 2 * (dv + dv_end);
    stopped(y, y + 1, v, c);
    return larger(largest, larger(fabs(x_free - x_end), h * h / 6 * fabs(dv_end - dv)) / c->stroke);
}

/* Advance y by one step whose estimated error goes into `largest`. Return whether it came near an open port's pressure:
   such a step is implicit. */
static bool checked_step(double *y, const Driven *driven, double h, double *Y, double *K, double *largest) {
    const Plant *plant = driven->plant;
    double before[6];
    memcpy(before, y, sizeof before);
    full_order_step(y, driven, h, Y, K);
    const double u = limited(command(driven->reference, before[0], driven->drive), plant->valve.u_max);
    for (int side = 0; side < 2; side++) {
        const double own = side ? own_command_of_B(u, driven->u_B, plant->valve.u_max) : u, x = sign_of(side) * before[0];
        const double *now = before + 2 + 2 * side, *later = Y + 6 + 2 + 2 * side;
        if (!near_port(own, x, now[0], now[1], later, STAGES, 6, h, chamber_of(&plant->cylinder, side), plant)) continue;
        memcpy(y, before, sizeof before);
        *largest = step_near_port(y, driven, h, Y);
        return true;
    }
    *largest = relative_error(driven, h, Y + 36, K);
    for (int side = 0; side < 2; side++) put_back(y + 2 + 2 * side, Y[36], chamber_of(&plant->cylinder, side), plant);
    return false;
}

/* Reverse the open-loop command where the piston is beyond x_reverse and would be driven further. */
static double reversed_at(double x, double reference, double *sign, const Drive *drive) {
    if (drive->closed_loop || (drive->each_stage && !drive->toggles)) return reference;
    reference *= *sign;
    if (fabs(x) < drive->x_reverse || reference * x <= 0) return reference;
    if (drive->toggles) *sign = -*sign;
    return -reference;
}

/* Flow that the chambers draw from the supply at its full pressure, over the largest: by ISO 6358. With its square the
   pressure falls behind a line that obeys the same law. */
static double drawn_flow(const double *y, double reference, const double *u_B, const Drive *drive, const Plant *plant) {
    const double u_max = plant->valve.u_max, b = plant->gas.critical_ratio;
    const double u = limited(command(reference, y[0], drive), u_max);
    double drawn = 0;
    for (int side = 0; side < 2; side++) {
        const double own = side ? own_command_of_B(u, u_B, u_max) : u;
        const double beyond = (y[2 + 2 * side] / plant->conditions.P_s - b) / (1 - b);
        const double part = larger(0, smaller(beyond, 1));
        drawn += larger(own, 0) / u_max * sqrt(1 - part * part);
    }
    return drawn;
}

/* As `run`; `sags` is a constant of the compiler's, so that a constant supply costs nothing. */
INLINE void run_with(const double *y_0, double *reference, const double *u_B, int64_t steps, double force,
                     const Drive *of_drive, const Plant *of_plant, double h, int most_halvings, double *states,
                     int8_t *halvings, bool sags) {
    const Plant here = *of_plant, *plant = &here; /* that the compiler sees what does not change */
    const Drive as_given = *of_drive, *drive = &as_given;
    const double decay = exponential(-h / (1e-3 * SUPPLY_LINE_MS));
    double sign = 1, drawn = 0, Y[42], K[42];
    Plant sagging = here;
    memcpy(states, y_0, 6 * sizeof *states);
    for (int64_t k = 0; k < steps; k++) {
        const double *before = states + 6 * k;
        double *after = states + 6 * (k + 1);
        reference[k] = reversed_at(before[0], reference[k], &sign, drive);
        const double *own = u_B ? u_B + k : NULL;
        if (sags) {
            drawn = decay * drawn + (1 - decay) * drawn_flow(before, reference[k], own, drive, plant);
            sagging.conditions.P_s = plant->conditions.P_s * (1 - plant->sag * drawn * drawn);
        }
        const Driven driven = {reference[k], force, drive, sags ? &sagging : plant, own};
        for (int n = 0;; n++) {
            int parts = 1 << n;
            double largest = 0, error;
            memcpy(after, before, 6 * sizeof *after);
            for (int part = 0; part < parts; part++) {
                if (most_halvings == 0) {
                    full_order_step(after, &driven, h / parts, Y, K);
                    continue;
                }
                checked_step(after, &driven, h / parts, Y, K, &error);
                largest = larger(error, largest);
                if (!(largest <= STEP_TOLERANCE) && n < most_halvings) break; /* to be halved again */
            }
            halvings[k] = (int8_t)n;
            if (largest <= STEP_TOLERANCE || n >= most_halvings) break;
        }
    }
    reference[steps] = reversed_at(states[6 * steps], reference[steps], &sign, drive);
}

void run(const double *y_0, double *reference, const double *u_B, int64_t steps, double force, const Drive *drive,
         const Plant *plant, double h, int most_halvings, double *states, int8_t *halvings) {
    if (plant->sag > 0)
        run_with(y_0, reference, u_B, steps, force, drive, plant, h, most_halvings, states, halvings, true);
    else
        run_with(y_0, reference, u_B, steps, force, drive, plant, h, most_halvings, states, halvings, false);
}

/* Mass from the supply into both chambers in each step. Near a port's pressure the flow jumps from stage to stage, so
   only the flow through the narrower path is taken from both ends of the step: the rest is the chamber's content. */
void supplied_mass(const double *states, const double *u, const double *u_B, int64_t steps, const Plant *plant, double h,
                   double *m) {
    const Valve *valve = &plant->valve;
    const Conditions *c = &plant->conditions;
    for (int64_t k = 0; k < steps; k++) {
        const double now = limited(u[k], valve->u_max), of_B = own_command_of_B(now, u_B ? u_B + k : NULL, valve->u_max);
        m[k] = 0;
        for (int side = 0; side < 2; side++) {
            const double own = side == 0 ? now : of_B, sign = sign_of(side);
            const Chamber chamber = chamber_of(&plant->cylinder, side);
            const double area[2] = {path_area(own, side, 0, valve), path_area(own, side, 1, valve)};
            const int narrow = area[1] <= area[0];
            const Gas gas = path_gas(side, narrow, plant);
            for (int end = 0; end < 2; end++) {
                const double *y = states + 6 * (k + end), P = y[2 + 2 * side], T = y[3 + 2 * side];
                const double content = P * volume(sign * y[0], chamber, &plant->cylinder) / (plant->gas.R * T);
                double m_in, m_out;
                port_flows(area[narrow], narrow ? c->P_atm : c->P_s, P, T, valve, &gas, c, &m_in, &m_out);
                const double flow = (m_in - m_out) * h / 2;
                m[k] += narrow == 0 ? flow : (end == 0 ? -content : content) - flow;
            }
        }
    }
}

/* Where a stage at the end reads the next sample, half a step would read it for half the time; such a step is halved
   only where it fails. */
double replay_tolerance(const Sampling *sampling) { return sampling->next_at_end ? DBL_MAX : STEP_TOLERANCE; }

static double line_between(const double *series, int64_t width, double position, int64_t every, int64_t last) {
    if (!(position > 0) || last == 0) return series[0];
    int64_t k = position < (double)(last - 1) ? (int64_t)position : last - 1;
    double first = series[width * (k * every)], next = series[width * ((k + 1) * every)];
    return first + (position - (double)k) * (next - first);
}

static double held_at(const double *series, int64_t width, int64_t sample, double delay, int64_t every, int64_t last) {
    int64_t k = sample - (int64_t)delay;
    k = k < 0 ? 0 : k > last ? last : k;
    return series[width * (k * every)];
}

/* Limited u of chamber A, x, v and own u of chamber B at the six stages of a part of step k, and at its end. The parts of a step must be asked for in
   order: with exact sampling the full order is integrated again, and y keeps its states. Return whether the full order
   came near an open port's pressure in it. */
bool stage_inputs(const Recording *r, const Sampling *sampling, int64_t k, int part, int parts, double *y,
                  double inputs[7][4]) {
    double u_max = r->plant.valve.u_max;
    if (sampling->exact) {
        double Y[42], K[42], error;
        bool near = false;
        const Driven driven = {r->reference[k], 0, &r->drive, &r->plant, r->u_B ? r->u_B + k : NULL};
        if (part == 0) memcpy(y, r->states + 6 * k, 6 * sizeof *y);
        if (r->most_halvings > 0) near = checked_step(y, &driven, r->h / parts, Y, K, &error);
        else full_order_step(y, &driven, r->h / parts, Y, K);
        for (int i = 0; i <= STAGES; i++) {
            inputs[i][0] = limited(command(driven.reference, Y[6 * i], &r->drive), u_max);
            inputs[i][1] = Y[6 * i];
            inputs[i][2] = Y[6 * i + 1];
            inputs[i][3] = own_command_of_B(inputs[i][0], driven.u_B, u_max);
        }
        return near;
    }
    const double *series[4] = {r->u, r->states, r->states + 1, r->u_B};
    const int64_t width[4] = {1, 6, 6, 1}, every = sampling->every, last = r->steps / every;
    for (int i = 0; i <= STAGES; i++) {
        const double fraction = (part + C[i]) / parts, position = ((double)k + fraction) / (double)every;
        const int64_t sample = (sampling->next_at_end && fraction == 1 ? k + 1 : k) / every;
        for (int s = 0; s < 4; s++) {
            const double delay = sampling->delay[s % 3]; /* that of u for both commands */
            if (!series[s]) continue;
            inputs[i][s] = sampling->held ? held_at(series[s], width[s], sample, delay, every, last)
                                          : line_between(series[s], width[s], position - delay, every, last);
        }
        inputs[i][0] = limited(inputs[i][0], u_max);
        inputs[i][3] = own_command_of_B(inputs[i][0], r->u_B ? &inputs[i][3] : NULL, u_max);
    }
    return false;
}

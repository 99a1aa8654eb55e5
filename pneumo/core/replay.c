/* Replays of reduced models on a recorded run: many lanes at once, or one after another where a lane's equations or
   pressures are beyond the polynomials of lanes.h. */
#include "lanes.h"
#include "open_port.h"

/* Add a term to every lane's sum, with Kahan's compensation of rounding errors. */
INLINE void add(double sums[2][ROW], int64_t i, double term) {
    term -= sums[1][i];
    double total = sums[0][i] + term;
    sums[1][i] = (total - sums[0][i]) - term;
    sums[0][i] = total;
}

/* Coefficients of lanes, sorted by what their rates need, and first pressures P_0. */
void start_lanes(Lanes *W, const Lane *lanes, int64_t count, const Plant *plant) {
    const Conditions *c = &plant->conditions;
    memset(W, 0, sizeof *W);
    W->count = (count + WIDTH - 1) / WIDTH * WIDTH;
    W->polytropic = W->heated = W->heated_PT = W->count;
    for (int64_t i = 0; i < W->count; i++) {
        const Lane lane = lanes[i < count ? i : count - 1];
        double n_in = lane.n_in * lane.flow_scale, n_out = lane.n_out * lane.flow_scale;
        W->n_V[i] = lane.n_V;
        W->a_half[i] = lane.a / 2;
        W->in[i] = n_in * lane.mixing * c->T_in;
        W->in_T[i] = n_in * (1 - lane.mixing) * c->T_0;
        W->out[i] = n_out * sqrt(c->T_0);
        W->wall[i] = lane.wall_scale * (1 - lane.e_A);
        W->wall_A[i] = lane.wall_scale * lane.e_A * (lane.e_PT == 0);
        W->wall_APT[i] = lane.wall_scale * lane.e_A * (lane.e_PT != 0);
        W->now[0][i] = W->now[1][i] = W->root_T[i] = 1;
        int64_t group = i / WIDTH * WIDTH;
        int need = lane.wall_scale != 0 ? (lane.e_PT != 0 ? 3 : 2) : lane.a != 0;
        if (need >= 1 && group < W->polytropic) W->polytropic = group;
        if (need >= 2 && group < W->heated) W->heated = group;
        if (need >= 3 && group < W->heated_PT) W->heated_PT = group;
    }
}

/* Advance both chambers of every lane by one step; NaN where a pressure is not positive. */
INLINE void advance(Lanes *W, double inputs[7][4], double h, const Constants *k, int terms) {
    const int64_t n = W->count;
    int first = W->fresh && memcmp(W->inputs, inputs[0], sizeof W->inputs) == 0;
    for (int side = 0; first && side < 2; side++) copy_row(W->k[side][0], W->k[side][6], n);
    for (int j = first; j < STAGES; j++)
        for (int side = 0; side < 2; side++) { /* neither waits for the other, so the processor works on both */
            double(*restrict K)[ROW] = W->k[side], *restrict now = W->now[side], *restrict p = W->p;
            double a_0 = h * A[j][0], a_1 = h * A[j][1], a_2 = h * A[j][2], a_3 = h * A[j][3], a_4 = h * A[j][4];
            if (j == 0)
                for (int64_t i = 0; i < n; i++) p[i] = now[i];
            else if (j < 3)
                for (int64_t i = 0; i < n; i++) p[i] = now[i] + (a_0 * K[0][i] + a_1 * K[1][i]);
            else
                for (int64_t i = 0; i < n; i++)
                    p[i] = now[i] + ((a_0 * K[0][i] + a_1 * K[1][i] + a_2 * K[2][i]) + a_3 * K[3][i] + a_4 * K[4][i]);
            double sign = sign_of(side);
            Shared sh = shared_terms(side ? inputs[j][3] : inputs[j][0], sign * inputs[j][1], sign * inputs[j][2], side, k);
            write_rates(W, K[j], sh, k, terms);
        }
    for (int side = 0; side < 2; side++) {
        double(*restrict K)[ROW] = W->k[side], *restrict now = W->now[side];
        for (int64_t i = 0; i < n; i++) {
            double early = B[0] * K[0][i] + B[2] * K[2][i];
            double late = B[3] * K[3][i] + B[4] * K[4][i] + B[5] * K[5][i];
            double p = now[i] + h * (early + late);
            now[i] = p > 0 ? p : (double)NAN;
        }
    }
    W->fresh = 0;
}

/* Repeat a step of lanes that come near to the port's pressure by the method of open_port.h. */
INLINE void repeat_near_port(Lanes *W, double inputs[7][4], double h, const Constants *k, int terms) {
    const double *at = inputs[STAGES];
    for (int side = 0; side < 2; side++) {
        const double sign = sign_of(side);
        const Shared sh = shared_terms(side ? at[3] : at[0], sign * at[1], sign * at[2], side, k);
        const double port = sh.p_port, factor = GAMMA * h * k->psi[0] / sqrt(port);
        double *restrict rate = W->k[side][6], *restrict now = W->now[side]; /* the error needs the first six */
        Shared still = sh; /* at the port's pressure there is no flow */
        still.inward = still.outward = 0;
        for (int64_t i = 0; i < W->count; i++) W->p[i] = port;
        write_rates(W, rate, still, k, terms);
        for (int64_t i = 0; i < W->count; i++) {
            const double p = W->start[side][i], root_T = W->root_T[i];
            const double in = factor * (sh.inward * (W->in[i] + W->in_T[i] * (root_T * root_T)));
            const double out = -factor * (sh.outward * (W->out[i] * port * root_T));
            double first, end = step_with_factors(p, port, port, h * rate[i], in, out, &first);
            W->at_port[side][i] = error_with_factors(p, now[i], end, first, port, in, out);
            now[i] = W->at_port[side][i] < 0 ? now[i] : end > 0 ? end : (double)NAN;
        }
    }
}

/* Raise `largest` to the estimated error of the last step over P_0; infinite where it failed. */
INLINE void estimate_errors(Lanes *W, double inputs[7][4], double h, bool near_port, const Constants *k, int terms) {
    const int64_t n = W->count;
    for (int side = 0; side < 2; side++) {
        double(*restrict K)[ROW] = W->k[side], *restrict largest = W->largest[side], sign = sign_of(side);
        copy_row(W->p, W->now[side], n);
        Shared sh = shared_terms(side ? inputs[6][3] : inputs[6][0], sign * inputs[6][1], sign * inputs[6][2], side, k);
        write_rates(W, K[6], sh, k, terms);
        for (int64_t i = 0; i < n; i++) {
            double early = E[0] * K[0][i] + E[2] * K[2][i] + E[3] * K[3][i];
            double error = fabs(h * (early + (E[4] * K[4][i] + E[5] * K[5][i] + E[6] * K[6][i])));
            if (near_port) error = W->at_port[side][i] < 0 ? error : W->at_port[side][i];
            double most = largest[i] > error ? largest[i] : error;
            largest[i] = error < INFINITY ? most : (double)INFINITY;
        }
    }
    memcpy(W->inputs, inputs[6], sizeof W->inputs);
    W->fresh = 1;
}

/* Keep the pressures of lanes that were not yet accurate; return whether some must be halved again. */
INLINE int keep_accurate(Lanes *W, double tolerance) {
    double left = 0;
    for (int side = 0; side < 2; side++) {
        double *restrict after = W->after[side], *restrict coarse = W->coarse[side];
        for (int64_t i = 0; i < W->count; i++) {
            after[i] = coarse[i] > 0 ? W->now[side][i] : after[i];
            coarse[i] = coarse[i] > 0 && !(W->largest[side][i] <= tolerance) ? 1 : 0;
            left += coarse[i];
        }
    }
    return left > 0;
}

/* One chamber of a lane on the inputs of a step; `exact` inputs are those of a run, which came near an open port or not. */
typedef struct {
    double (*inputs)[4], sign;
    Chamber chamber;
    const Plant *plant;
    const Lane *lane;
    bool checked, exact, held, near_port;
} Replayed;

INLINE void lane_rates(const double *y, int stage, const void *context, double *dy) {
    const Replayed *c = context;
    double u = c->inputs[stage][c->chamber.side ? 3 : 0], x = c->sign * c->inputs[stage][1], v = c->sign * c->inputs[stage][2];
    chamber_rates(u, x, v, y[0], y[1], c->chamber, c->plant, c->lane, dy);
}

INLINE bool possible(const double *y, const Lane *lane) { return y[0] > 0 && (lane->full == 0 || y[1] > 0); }

/* Whether a step of the full order through the states Y is implicit, as in a run. */
static bool is_near_port(const Replayed *c, const double *Y, double h) {
    if (!c->checked || c->held || c->lane->full == 0) return false;
    const double u = c->inputs[0][c->chamber.side ? 3 : 0], x = c->sign * c->inputs[0][1];
    return c->near_port || near_port(u, x, Y[0], Y[1], Y + 2, STAGES, 2, h, c->chamber, c->plant);
}

static double lane_step_near_port(double *y, const Replayed *c, double h) {
    const int of_u = c->chamber.side ? 3 : 0;
    const double x = c->inputs[0][1], speed = (c->inputs[STAGES][1] - x) / h, part = (GAMMA - C[1]) / (C[2] - C[1]);
    const double u_first = c->inputs[1][of_u] + part * (c->inputs[2][of_u] - c->inputs[1][of_u]);
    const Filling filling = {c->inputs[STAGES][of_u], c->sign * x, c->sign * speed, h, c->chamber, c->plant};
    return implicit_step(y, &filling, u_first);
}

/* Repeat a step of a reduced model that comes near to the port's pressure, as `repeat_near_port` does: P is the pressure
   before it, `y` that after an explicit step. Return the error, or -1 if the pressure is not near. */
static double repeat_lane_near_port(double *y, double P, const Replayed *c, double h) {
    const double *at = c->inputs[STAGES];
    const Plant *plant = c->plant;
    const Conditions *around = &plant->conditions;
    const Lane *lane = c->lane;
    const double u = at[c->chamber.side ? 3 : 0], x = c->sign * at[1];
    const double V = volume(x, c->chamber, &plant->cylinder);
    const double areas[2] = {path_area(u, c->chamber.side, 0, &plant->valve), path_area(u, c->chamber.side, 1, &plant->valve)};
    const int port = areas[0] >= areas[1] ? 0 : 1;
    const Gas gas = path_gas(c->chamber.side, port, plant);
    const double P_port = port == 0 ? around->P_s : around->P_atm, T = temperature(P_port, around->P_0, around->T_0, lane->a);
    const double T_inlet = lane->mixing * around->T_in + (1 - lane->mixing) * T;
    const double factor = GAMMA * h * plant->gas.R * lane->flow_scale / V;
    const double in = factor * lane->n_in * T_inlet * flow_over_root(areas[port], P_port, around->T_in, &gas);
    const double out = factor * lane->n_out * T * flow_over_root(areas[port], P_port, T, &gas);
    double rates[2], first;
    chamber_rates(u, x, c->sign * at[2], P_port, T, c->chamber, plant, lane, rates);
    const double end = step_with_factors(P, P_port, P_port, h * rates[0], in, out, &first);
    const double error = error_with_factors(P, y[0], end, first, P_port, in, out);
    if (!(error < 0)) y[0] = end;
    return error / around->P_0;
}

/* Advance y = (P, T) of one chamber; return the largest estimated error over P_0 or T_0, infinite where it failed. */
static double lane_step(double *y, const Replayed *context, double h) {
    double Y[14], K[14], error[2], largest = 0;
    const Conditions *c = &context->plant->conditions;
    dormand_prince(lane_rates, context, y, 2, h, Y, K, Y + 12);
    bool implicit = is_near_port(context, Y, h);
    if (implicit) largest = lane_step_near_port(y, context, h);
    else memcpy(y, Y + 12, 2 * sizeof *y);
    if (context->near_port && context->lane->full == 0) {
        largest = repeat_lane_near_port(y, Y[0], context, h);
        implicit = !(largest < 0);
    }
    if (!possible(y, context->lane)) {
        y[0] = y[1] = (double)NAN;
        return (double)INFINITY;
    }
    if (!context->checked) return 0;
    if (!implicit) {
        embedded_error(lane_rates, context, y, 2, h, K, error);
        largest = fabs(error[0]) / c->P_0;
        if (context->lane->full != 0) {
            largest = larger(fabs(error[1]) / c->T_0, largest);
            if (context->exact) put_back(y, context->inputs[STAGES][1], context->chamber, context->plant);
        }
    }
    return largest < INFINITY ? largest : (double)INFINITY;
}

/* Full orders whose steps are never halved advance two at a time, with both chambers of each as one vector: element
   2 i + side. Every element does what `chamber_rates` does, operation by operation. */
enum { PAIR = 4 };
typedef struct {
    double (*inputs)[4], wall_scale[PAIR];
    const Plant *plant;
    int64_t count; /* PAIR; the compiler would unroll a constant count before it makes vectors of loops */
} Pair;

static bool pairs_allowed(const Recording *r, const Lane *lanes, int64_t count) {
    const Valve *valve = &r->plant.valve;
    bool allowed = r->most_halvings == 0 && count % 2 == 0;
    allowed = allowed && !r->plant.gas.elliptic && valve->laminar == 0 && valve->leak == 0 && !valve->net_leak;
    for (int i = 0; i < 4; i++) allowed = allowed && valve->paths.knots == 0 && valve->paths.b[i / 2][i % 2] == 0;
    Lane full = full_order(&r->plant);
    allowed = allowed && full.e_A == 1 && full.e_PT == 0.5;
    for (int64_t i = 0; i < count; i++) {
        full.wall_scale = lanes[i].wall_scale; /* in which they may differ */
        allowed = allowed && full.wall_scale != 0 && memcmp(&full, lanes + i, sizeof full) == 0;
    }
    return allowed;
}

INLINE void rates_of_pair(const double *y, int stage, const void *context, double *dy) {
    const Pair *c = context;
    const int64_t n = c->count & -PAIR;
    const Plant *plant = c->plant;
    const Conditions *k = &plant->conditions;
    const Gas gas = plant->gas;
    const Lane lane = full_order(plant);
    const double *P = y, *T = y + PAIR, T_in = k->T_in, T_amb = k->T_amb;
    double P_port[PAIR], area[PAIR], V[PAIR], dV_dt[PAIR], k_wall[PAIR];
    double P_u[PAIR], T_u[PAIR], ratio[PAIR], subsonic[PAIR], m_in[PAIR], m_out[PAIR];
    for (int side = 0; side < 2; side++) {
        const double sign = sign_of(side), u = c->inputs[stage][side ? 3 : 0], x = sign * c->inputs[stage][1];
        const Chamber chamber = chamber_of(&plant->cylinder, side);
        const double k_here = plant->k_0 * (heat_area(x, &plant->cylinder) / heat_area(0, &plant->cylinder));
        for (int64_t i = side; i < PAIR; i += 2) {
            P_port[i] = u >= 0 ? k->P_s : k->P_atm; /* of the one path that is open */
            area[i] = path_area(u, side, u < 0, &plant->valve);
            V[i] = volume(x, chamber, &plant->cylinder);
            dV_dt[i] = chamber.area * (sign * c->inputs[stage][2]);
            k_wall[i] = k_here;
        }
    }
    for (int64_t i = 0; i < n; i++) {
        const double own = P[i], T_own = T[i], port = P_port[i];
        P_u[i] = port >= own ? port : own;
        T_u[i] = port >= own ? T_in : T_own;
        ratio[i] = (port >= own ? own : port) / P_u[i];
    }
    for (int64_t i = 0; i < n; i++) subsonic[i] = subsonic_flow(area[i], P_u[i], ratio[i], T_u[i], &gas);
    for (int64_t i = 0; i < n; i++) {
        const double choked = choked_flow(area[i], P_u[i], T_u[i], &gas), below = subsonic[i];
        const double m = ratio[i] <= gas.critical_ratio ? choked : below;
        m_in[i] = lane.flow_scale * (P_port[i] >= P[i] ? m : 0);
        m_out[i] = lane.flow_scale * (P_port[i] >= P[i] ? 0 : m);
    }
    for (int64_t i = 0; i < n; i++) {
        const double heat = c->wall_scale[i] * (k_wall[i] * sqrt(P[i] * T[i] / (k->P_0 * k->T_0)) * (T_amb - T[i]));
        const double T_inlet = lane.mixing * T_in + (1 - lane.mixing) * T[i];
        dy[i] = dP_dt(P[i], T[i], V[i], dV_dt[i], m_in[i], m_out[i], T_inlet, heat, lane.n_V, lane.n_in, lane.n_out,
                      gas.R, gas.gamma);
        dy[PAIR + i] = dT_dt(P[i], T[i], V[i], dV_dt[i], m_in[i], m_out[i], dy[i], gas.R);
    }
}

/* Advance two lanes from y, (lane, chamber, 2), by a step. */
CLONES void advance_pair(double *y, double inputs[7][4], const Lane *lanes, const Plant *plant, double h, int64_t count) {
    double at[2 * PAIR], Y[2 * PAIR * STAGES], K[2 * PAIR * STAGES];
    const double first = lanes[0].wall_scale, second = lanes[1].wall_scale;
    const Plant here = *plant;
    const Pair pair = {inputs, {first, first, second, second}, &here, count};
    for (int i = 0; i < PAIR; i++) {
        at[i] = y[2 * i];
        at[PAIR + i] = y[2 * i + 1];
    }
    dormand_prince(rates_of_pair, &pair, at, 2 * PAIR, h, Y, K, at);
    for (int i = 0; i < PAIR; i++) {
        const bool fine = at[i] > 0 && at[PAIR + i] > 0;
        y[2 * i] = fine ? at[i] : (double)NAN;
        y[2 * i + 1] = fine ? at[PAIR + i] : (double)NAN;
    }
}

static void begin_in_turn(const Recording *r, const LanesInTurn *t) {
    const int64_t stored = r->steps / t->stride + 1;
    memset(t->moments, 0, (size_t)t->count * 4 * sizeof *t->moments);
    for (int64_t i = 0; i < 2 * t->count; i++) {
        t->failure[i] = -1;
        t->pressure[i * stored] = t->y[2 * i];
    }
}

static void begin_step_in_turn(const LanesInTurn *t) {
    for (int64_t i = 0; i < 2 * t->count; i++) {
        memcpy(t->step + 3 * i, t->y + 2 * i, 2 * sizeof *t->y);
        t->step[3 * i + 2] = t->failure[i] < 0 ? 0 : -1;
    }
}

/* Advance lanes, whose step is not accurate yet, over a part of it. */
static void advance_in_turn(const Recording *r, const Sampling *sampling, const LanesInTurn *t, bool pairs, int part,
                            double inputs[7][4], double h, bool near_port) {
    for (int64_t i = 0; pairs && i < t->count; i += 2) advance_pair(t->y + 4 * i, inputs, t->lanes + i, &r->plant, h, PAIR);
    for (int64_t i = 0; !pairs && i < 2 * t->count; i++) {
        double *before = t->step + 3 * i, *largest = before + 2, *now = t->y + 2 * i;
        if (*largest < 0) continue;
        const int side = (int)(i % 2);
        const Replayed context = {inputs, sign_of(side), chamber_of(&r->plant.cylinder, side), &r->plant, t->lanes + i / 2,
                                  r->most_halvings > 0, sampling->exact, sampling->held, near_port};
        if (part == 0) {
            memcpy(now, before, 2 * sizeof *now);
            *largest = 0;
        }
        const double error = lane_step(now, &context, h);
        *largest = larger(error, *largest);
    }
}

/* As `keep_accurate`. */
static bool keep_accurate_in_turn(const LanesInTurn *t, double tolerance) {
    bool left = false;
    for (int64_t i = 0; i < 2 * t->count; i++) {
        double *largest = t->step + 3 * i + 2;
        if (*largest <= tolerance) *largest = -1;
        left = left || *largest > 0;
    }
    return left;
}

static void end_step_in_turn(const Recording *r, int64_t step, const LanesInTurn *t) {
    const int64_t stored = r->steps / t->stride + 1;
    for (int64_t i = 0; i < 2 * t->count; i++) {
        const double *now = t->y + 2 * i, error = r->states[6 * (step + 1) + 2 + 2 * (i % 2)] - now[0];
        if (t->failure[i] < 0 && !possible(now, t->lanes + i / 2)) t->failure[i] = step + 1;
        t->moments[2 * i] += error;
        t->moments[2 * i + 1] += error * error;
        if ((step + 1) % t->stride == 0) t->pressure[i * stored + (step + 1) / t->stride] = now[0];
    }
}

INLINE void replay_steps(const Recording *r, const Sampling *sampling, int64_t first, int64_t end, Lanes *W,
                         const Constants *k, int terms, double *pressure,
                         const LanesInTurn *in_turn) {
    const double P_0 = r->plant.conditions.P_0, tolerance = replay_tolerance(sampling);
    const int most = r->most_halvings;
    const int64_t n = W->count;
    const bool pairs = pairs_allowed(r, in_turn->lanes, in_turn->count);
    double y[6], inputs[7][4];
    for (int64_t step = first; step < end; step++) {
        int halvings = sampling->exact ? r->halvings[step] : 0, begun = halvings;
        if (most > 0)
            for (int side = 0; side < 2; side++)
                for (int64_t i = 0; i < n; i++) {
                    W->before[side][i] = W->now[side][i];
                    W->coarse[side][i] = W->now[side][i] > 0 ? 1 : 0;
                }
        bool left = n > 0, left_in_turn = in_turn->count > 0;
        begin_step_in_turn(in_turn);
        for (;; halvings++) {
            int parts = 1 << halvings;
            if (most > 0 && left) {
                for (int side = 0; side < 2; side++) {
                    copy_row(W->now[side], W->before[side], n);
                    for (int64_t i = 0; i < n; i++) W->largest[side][i] = 0;
                }
                if (halvings > begun) W->fresh = 0;
            }
            for (int part = 0; part < parts; part++) {
                const bool near_port = stage_inputs(r, sampling, step, part, parts, y, inputs);
                if (left_in_turn)
                    advance_in_turn(r, sampling, in_turn, pairs, part, inputs, r->h / parts, near_port);
                if (!left) continue;
                for (int side = 0; near_port && side < 2; side++) copy_row(W->start[side], W->now[side], n);
                advance(W, inputs, r->h / parts, k, terms);
                if (near_port) repeat_near_port(W, inputs, r->h / parts, k, terms);
                if (most > 0) estimate_errors(W, inputs, r->h / parts, near_port, k, terms);
            }
            if (most == 0) break;
            left = left && keep_accurate(W, tolerance);
            left_in_turn = left_in_turn && keep_accurate_in_turn(in_turn, tolerance);
            if (!(left || left_in_turn) || halvings >= most) break;
        }
        if (most > 0) {
            for (int side = 0; side < 2; side++) copy_row(W->now[side], W->after[side], n);
            if (halvings > begun) W->fresh = 0; /* some lanes kept an earlier result */
        }
        end_step_in_turn(r, step, in_turn);
        for (int side = 0; n > 0 && side < 2; side++) {
            double P_full = r->states[6 * (step + 1) + 2 + 2 * side];
            double *restrict out = pressure + ((step - first) * 2 + side) * n;
            for (int64_t i = 0; i < n; i++) {
                double P = P_0 * W->now[side][i], error = P_full - P;
                add(W->sum[side], i, error);
                add(W->squares[side], i, error * error);
                out[i] = P;
            }
        }
    }
}

/* The polynomial's length is a constant in each call, so that its loop is unrolled. */
CLONES void replay_lanes(const Recording *r, const Sampling *sampling, int64_t first, int64_t end, Lanes *W,
                         const double *psi, int terms, double *pressure, const LanesInTurn *in_turn) {
    const Constants k = constants_of(&r->plant, psi);
    if (first == 0) begin_in_turn(r, in_turn);
    if (terms == 10) replay_steps(r, sampling, first, end, W, &k, 10, pressure, in_turn);
    else if (terms == 14) replay_steps(r, sampling, first, end, W, &k, 14, pressure, in_turn);
    else replay_steps(r, sampling, first, end, W, &k, 18, pressure, in_turn);
}

/* Lanes in turn, without others side by side. */
void replay_scalar(const Recording *r, const Sampling *sampling, const LanesInTurn *lanes) {
    Lanes none;
    none.count = none.fresh = 0;
    replay_lanes(r, sampling, 0, r->steps, &none, NULL, 0, NULL, lanes);
}

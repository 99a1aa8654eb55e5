/* Pressures of both chambers by several sets of parameters, for fits: each set is a lane with dead volumes of its own,
   and with the signals and the plant of its `Inputs`.
   Kutta's method of third order; a step that meets the pressure of the open port, where the slope of eq (1) is
   infinite, is implicit. A weight leads from one to the other, since a fit needs pressures that are smooth functions
   of the parameters. Docstrings in pneumo.simulation.fitted_pressures. */
#include "lanes.h"
#include "open_port.h"

enum { KUTTA_STAGES = 3 };
static const double A_3[3][2] = {{0}, {1.0 / 2}, {-1, 2}};
static const double B_3[3] = {1.0 / 6, 2.0 / 3, 1.0 / 6};
#define EQUAL 1e-9 /* relative difference of pressures whose logarithmic mean is either */

/* All inputs of a call, with the constants of each, and what their plants have in common. */
typedef struct {
    Inputs *inputs;
    int64_t count;
    Constants constants[ROW];
    double P_0, T_0, T_amb, gamma;
} AllInputs;

/* Write each lane's terms of a chamber's rates at one stage: those of its inputs, at the opening of the stage `of_u`. */
INLINE void write_terms(AllInputs *all, int64_t step, int stage, int of_u, int side, const Lanes *W, Sets *restrict X) {
    const double sign = sign_of(side);
    for (int64_t j = 0, i = 0; j < all->count; j++) {
        Inputs *of = all->inputs + j;
        Constants *k = all->constants + j;
        const int64_t place = step * KUTTA_STAGES + stage, end = j + 1 < all->count ? of->end : W->count;
        const double P_s = of->P_s[step * KUTTA_STAGES + of_u];
        if (P_s != of->plant.conditions.P_s) {
            of->plant.conditions.P_s = P_s;
            k->ln_s = ln(P_s / all->P_0);
        }
        const double x = sign * of->motion[2 * place], v = sign * of->motion[2 * place + 1];
        const Chamber chamber = chamber_of(&of->plant.cylinder, side);
        const double V = volume(x, chamber, &of->plant.cylinder), area_v = chamber.area * v;
        /* at rest, in the plant's volume */
        const Shared sh = shared_terms(sign * of->u[step * KUTTA_STAGES + of_u], x, 0, side, k);
        const double supplied = sh.supplied ? 1 : 0;
        for (; i < end; i++) {
            X->volume_ratio[i] = V;
            X->expansion[i] = area_v;
            X->p_port[side][i] = sh.p_port;
            X->supplied[side][i] = supplied;
            X->ln_port[i] = sh.ln_port;
            X->inward[i] = sh.inward;
            X->outward[i] = sh.outward;
            X->wall[i] = sh.wall;
            X->wall_A[i] = sh.wall_A;
        }
    }
    for (int64_t i = 0; i < W->count; i++) {
        double V = X->volume_ratio[i], inverse_V = 1 / (V + X->beyond[side][i]);
        X->volume_ratio[i] = V * inverse_V;
        X->expansion[i] *= inverse_V;
    }
}

/* Write the pressures at the beginning of a step of the ports that are open at its end. */
INLINE void write_ports_before(const AllInputs *all, int64_t step, int side, int64_t lanes, Sets *X) {
    for (int64_t j = 0, i = 0; j < all->count; j++) {
        const double p_s = all->inputs[j].P_s[step * KUTTA_STAGES] / all->P_0;
        const int64_t end = j + 1 < all->count ? all->inputs[j].end : lanes;
        for (; i < end; i++) X->p_port_before[i] = X->supplied[side][i] > 0 ? p_s : X->p_port[side][i];
    }
}

/* As `write_rates`, of pistons at rest, with terms that each lane has for itself. */
INLINE void write_rates_of_sets(Lanes *restrict W, const Sets *restrict X, double *restrict rate, int side,
                                const AllInputs *all, int terms) {
    const int64_t n = W->count;
    const double T_0 = all->T_0, T_amb = all->T_amb;
    for (int64_t i = 0; i < n; i++) W->ln_p[i] = fast_log(W->p[i]);
    for (int64_t i = W->polytropic; i < n; i++) W->root_T[i] = fast_exp(W->a_half[i] * W->ln_p[i]); /* (6) */
    for (int64_t i = W->heated; i < n; i++) {
        double T = T_0 * (W->root_T[i] * W->root_T[i]);
        W->heat[i] = (X->wall[i] * W->wall[i] + X->wall_A[i] * W->wall_A[i]) * (T_amb - T); /* (13), (11) */
    }
    for (int64_t i = W->heated_PT; i < n; i++) {
        double T = T_0 * (W->root_T[i] * W->root_T[i]);
        W->heat[i] += X->wall_A[i] * W->wall_APT[i] * sqrt(W->p[i]) * W->root_T[i] * (T_amb - T); /* (7), (8) */
    }
    for (int64_t i = 0; i < n; i++) {
        double p = W->p[i], root_T = W->root_T[i], s = fabs(W->ln_p[i] - X->ln_port[i]), s_2 = s * s;
        double even = X->psi[terms - 2][i], odd = X->psi[terms - 1][i]; /* as in `polynomial` */
        for (int j = terms - 4; j >= 0; j -= 2) {
            even = even * s_2 + X->psi[j][i];
            odd = odd * s_2 + X->psi[j + 1][i];
        }
        double subsonic = sqrt(s) * (even + odd * s);
        double flow = s >= X->s_sonic[i] ? X->sonic[i] : subsonic; /* (1) */
        double inflow = X->inward[i] * (W->in[i] + W->in_T[i] * (root_T * root_T));
        double outflow = (X->outward[i] * p) * (W->out[i] * root_T);
        double energy = X->p_port[side][i] >= p ? inflow : outflow;
        rate[i] = flow * energy + W->heat[i];
    }
}

INLINE double smooth_step(double x) { return x <= 0 ? 0 : x >= 1 ? 1 : x * x * (3 - 2 * x); }

/* Repeat a step by an implicit Runge-Kutta method of two stages for lanes with a `weight` of it. Near the port's
   pressure the flow's term in dp/dt is K sign(d) sqrt(|d|) with d = p_port - p, and the other terms, b, hardly change:
   they are those in the middle of the step, at the port's pressure. */
INLINE void step_across_port(Lanes *W, Sets *X, int side, bool full, const AllInputs *all, double h, int terms) {
    const int64_t n = W->count;
    double *rate = W->k[side][0];
    for (int64_t i = 0; i < n; i++) W->p[i] = X->p_port[side][i];
    if (full)
        for (int64_t i = 0; i < n; i++) W->root_T[i] = sqrt(X->T[side][i]);
    write_rates_of_sets(W, X, rate, side, all, terms); /* at the port's pressure there is no flow */
    for (int64_t i = 0; i < n; i++) {
        const double weight = X->weight[side][i], before = W->before[side][i], root_T = W->root_T[i];
        if (!(weight > 0)) continue;
        const double p_port = X->p_port[side][i], p_port_before = X->p_port_before[i];
        const double p_port_then = p_port_before + GAMMA * (p_port - p_port_before), root = X->psi[0][i] / sqrt(p_port);
        double b = X->volume_ratio[i] * rate[i] - X->expansion[i] * (W->n_V[i] * p_port);
        double factor = GAMMA * h * X->volume_ratio[i] * (X->supplied[side][i] > 0 ? 1.0 : X->exhaust[i]) * root;
        double in = factor * (X->inward[i] * (W->in[i] + W->in_T[i] * (root_T * root_T)));
        double out = -factor * (X->outward[i] * (W->out[i] * p_port * root_T));
        double first, p = step_with_factors(before, p_port_then, p_port, h * b, in, out, &first);
        if (full) {
            double T_now = root_T * root_T, flow = (p - before) / h - b;
            double T_flow = flow > 0 ? X->inlet[i] : T_now;
            double change = p - before - h * flow / (all->gamma * T_flow) * T_now; /* as at a stage */
            double mean = fabs(p - before) > EQUAL * p ? (p - before) / ln(p / before) : p; /* logarithmic */
            double T = T_now * exponential(change / mean + h * X->expansion[i]);
            X->T[side][i] = weight < 1 ? T + (1 - weight) * (X->rate_T[side][0][i] - T) : T;
        }
        W->now[side][i] = weight < 1 ? p + (1 - weight) * (W->now[side][i] - p) : p;
    }
}

/* Rates of one chamber at one stage. `margin` is the least distance of a stage's pressure from the port's, negative on
   the other side of it, and `reach` a quarter of (h K)^2. */
INLINE void stage_rates(Lanes *restrict W, Sets *restrict X, int side, int stage, bool full, const AllInputs *all,
                        double h, int terms) {
    const int64_t n = W->count;
    const double gamma = all->gamma, a_0 = h * A_3[stage][0], a_1 = h * A_3[stage][1];
    double(*restrict K)[ROW] = W->k[side], *restrict rate = W->k[side][stage], *restrict now = W->now[side];
    double *restrict margin = X->margin[side], *restrict rate_T = X->rate_T[side][stage];
    const double *restrict p_port = X->p_port[side], *restrict supplied = X->supplied[side];
    for (int64_t i = 0; i < n; i++) {
        double p = now[i] + (a_0 * K[0][i] + a_1 * K[1][i]), d = now[i] >= p_port[i] ? p - p_port[i] : p_port[i] - p;
        margin[i] = stage == 0 || d < margin[i] ? d : margin[i];
        W->p[i] = p;
    }
    if (full)
        for (int64_t i = 0; i < n; i++)
            W->root_T[i] = sqrt(X->T[side][i] + (a_0 * X->rate_T[side][0][i] + a_1 * X->rate_T[side][1][i]));
    write_rates_of_sets(W, X, rate, side, all, terms);
    if (stage == KUTTA_STAGES - 1)
        for (int64_t i = 0; i < n; i++) {
            double root = h * X->psi[0][i] / sqrt(p_port[i]), root_T = W->root_T[i];
            double in = X->inward[i] * (W->in[i] + W->in_T[i] * (root_T * root_T));
            double out = -X->outward[i] * (W->out[i] * p_port[i] * root_T);
            double hK = (in > out ? in : out) * (supplied[i] > 0 ? 1.0 : X->exhaust[i]) * X->volume_ratio[i] * root;
            X->reach[side][i] = hK * hK / 4;
        }
    for (int64_t i = 0; i < n; i++) {
        double through_exhaust = W->heat[i] + X->exhaust[i] * (rate[i] - W->heat[i]);
        double still = supplied[i] > 0 ? rate[i] : through_exhaust, energy = still - W->heat[i];
        rate[i] = X->volume_ratio[i] * still - X->expansion[i] * (W->n_V[i] * W->p[i]);
        if (!full) continue;
        double T_now = W->root_T[i] * W->root_T[i], T_flow = energy > 0 ? X->inlet[i] : T_now;
        double change = rate[i] - X->volume_ratio[i] * energy / (gamma * T_flow) * T_now; /* less p dm/dt over m */
        rate_T[i] = T_now * (change / W->p[i] + X->expansion[i]); /* P V = m R T */
    }
}

/* Pressures, and temperatures of the full order, at the end of an explicit step, and the implicit one's weight; returns
   whether that is positive in a lane. */
INLINE bool step_end(Lanes *restrict W, Sets *restrict X, int side, bool full, double h) {
    const int64_t n = W->count;
    double(*restrict K)[ROW] = W->k[side], *restrict now = W->now[side], *restrict before = W->before[side];
    double *restrict weight = X->weight[side];
    const double *restrict p_port = X->p_port[side];
    double meeting = 0;
    for (int64_t i = 0; i < n; i++) {
        double p = now[i] + h * (B_3[0] * K[0][i] + B_3[1] * K[1][i] + B_3[2] * K[2][i]);
        double d = now[i] >= p_port[i] ? p - p_port[i] : p_port[i] - p, reach = X->reach[side][i];
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

INLINE void replay_steps(AllInputs *all, int64_t steps, Lanes *W, Sets *X, bool full, int64_t stride, double h, int terms,
                         double *pressure) {
    const int middle = 1, last = KUTTA_STAGES - 1;
    for (int64_t step = 0; step < steps; step++) {
        for (int stage = 0; stage < KUTTA_STAGES; stage++)
            for (int side = 0; side < 2; side++) {
                write_terms(all, step, stage, stage, side, W, X);
                stage_rates(W, X, side, stage, full, all, h, terms);
            }
        for (int side = 0; side < 2; side++) {
            if (!step_end(W, X, side, full, h)) continue;
            write_terms(all, step, middle, last, side, W, X); /* with the opening and the supply at the step's end */
            write_ports_before(all, step, side, W->count, X);
            step_across_port(W, X, side, full, all, h, terms);
            for (int stage = 0; stage < 2; stage++) { /* rates of a stage that failed would stay in later sums */
                memset(W->k[side][stage], 0, sizeof W->k[side][stage]);
                memset(X->rate_T[side][stage], 0, sizeof X->rate_T[side][stage]);
            }
        }
        if ((step + 1) % stride == 0)
            for (int side = 0; side < 2; side++)
                for (int64_t i = 0; i < W->count; i++)
                    pressure[((step + 1) / stride * 2 + side) * W->count + i] = all->P_0 * W->now[side][i];
    }
}

/* W is from `start_lanes` with the first inputs' plant. X has supply temperatures, K, exhausts, as the valve has them, each
   0 where it is the plant's, and dead volumes. */
CLONES void replay_sets(Inputs *inputs, int64_t count, int64_t steps, Lanes *W, Sets *X, bool full, int64_t stride,
                        double h, double *pressure) {
    const Plant *plant = &inputs->plant;
    const Conditions *c = &plant->conditions;
    AllInputs all = {.inputs = inputs, .count = count, .P_0 = c->P_0, .T_0 = c->T_0, .T_amb = c->T_amb, .gamma = plant->gas.gamma};
    int64_t terms = 0;
    for (int64_t j = 0, i = 0; j < count; j++) {
        const Inputs *of = inputs + j;
        Constants *k = all.constants + j;
        *k = constants_of(&of->plant, of->psi);
        for (const int64_t end = j + 1 < count ? of->end : W->count; i < end; i++) {
            X->s_sonic[i] = k->s_sonic;
            X->sonic[i] = of->plant.gas.sonic_coefficient;
            const double own = of->plant.conditions.T_in, T_in = X->inlet[i] > 0 ? X->inlet[i] : own, root = sqrt(T_in / own);
            W->in[i] *= own / c->T_in * root; /* the flow's factor has the root of the plant's T_in as divisor */
            W->in_T[i] /= root;
            X->inlet[i] = T_in / c->T_0;
            X->exhaust[i] = X->exhaust[i] > 0 ? X->exhaust[i] / of->plant.valve.exhaust : 1;
            for (int side = 0; side < 2; side++) X->beyond[side][i] -= chamber_of(&of->plant.cylinder, side).V_d;
            for (int64_t term = 0; term < of->terms; term++) X->psi[term][i] = of->psi[term]; /* others stay 0 */
        }
        terms = of->terms > terms ? of->terms : terms;
    }
    if (full) /* no temperature follows from the pressure; every lane has wall heat with the root of P T */
        W->polytropic = W->count, W->heated = W->heated_PT = 0;
    if (terms == 10) replay_steps(&all, steps, W, X, full, stride, h, 10, pressure);
    else if (terms == 14) replay_steps(&all, steps, W, X, full, stride, h, 14, pressure);
    else replay_steps(&all, steps, W, X, full, stride, h, 18, pressure);
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

/* Filter rows of a signal in place: y = z + now x, then z = before x + decay y, from z = start. */
void filter_first_order(double *signal, int64_t rows, int64_t samples, const double *start, double now, double before,
                        double decay) {
    for (int64_t row = 0; row < rows; row++, signal += samples) {
        double z = start[row];
        for (int64_t k = 0; k < samples; k++) {
            const double x = signal[k];
            signal[k] = z + now * x;
            z = before * x + decay * signal[k];
        }
    }
}

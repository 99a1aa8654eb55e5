/* Extended Kalman filter of motion, pressures and, if asked for, temperatures and k_0: the midpoint rule over each
   sample. Docstrings in pneumo.linear.observer. */
#include "rates.h"

enum { X_, V_, P_A, P_B, T_A, T_B, LN_K_0, SIZE }; /* states */
#define FIRST_PRESSURE 2e4 /* Pa, standard deviation of the first estimate of either pressure */
#define FIRST_TEMPERATURE 5.0 /* K, likewise */
#define FIRST_LN_K_0 0x1.fc8b7f138bdeap-1 /* ln 2.7, likewise */
#define K_0_RANGE 0x1.26bb1bbb55516p+1 /* ln 10, of ln k_0 around its first value */
#define K_0_NOISE 0.01 /* s^-0.5, process noise of ln k_0 */
/* Steps of derivatives: strokes; m/s; P_0; K; ln k_0. */
#define DX 1e-4
#define DV 1e-2
#define DP 1e-3
#define DT 0.1
#define DK 1e-3

typedef struct { const Plant *plant; const FilterModel *model; const Noise *noise; double h; } Filter;
typedef double Matrix[SIZE][SIZE];

static Lane with_k_0(const FilterModel *model, double ln_k_0) {
    Lane lane = model->lane;
    if (model->estimates_k_0) lane.wall_scale *= exponential(ln_k_0);
    return lane;
}

static void model_rates(const double *y, double u, const Filter *f, double *dy) {
    const Cylinder *c = &f->plant->cylinder;
    const Lane lane = with_k_0(f->model, y[LN_K_0]);
    motion(y[X_], y[V_], acceleration(y[X_], y[V_], y[P_A], y[P_B], 0, c), c, dy, dy + 1);
    for (int side = 0; side < 2; side++) {
        double sign = sign_of(side), rates[2];
        chamber_rates(sign * u, sign * y[X_], sign * y[V_], y[P_A + side], y[T_A + side], chamber_of(c, side), f->plant,
                      &lane, rates);
        dy[P_A + side] = rates[0];
        dy[T_A + side] = rates[1];
    }
    dy[LN_K_0] = 0;
}

/* Rates and their derivatives. Where a chamber has the pressure of its open port, the slope of eq (1) is infinite, so
   derivatives with respect to its pressure, and of its temperature's rate with respect to the temperature, are limited
   to 1 / h, in units of P_0 and T_0. */
static void derivatives(const double *y, double u, const Filter *f, Matrix D, double *dy) {
    const Plant *plant = f->plant;
    const Cylinder *c = &plant->cylinder;
    const double P_0 = plant->conditions.P_0, T_0 = plant->conditions.T_0, dx = DX * c->stroke, dP = DP * P_0;
    const Lane lane = with_k_0(f->model, y[LN_K_0]), other = with_k_0(f->model, y[LN_K_0] + DK);
    model_rates(y, u, f, dy);
    memset(D, 0, sizeof(Matrix));
    D[X_][V_] = 1;
    D[V_][X_] = -c->spring / c->M;
    D[V_][V_] = -c->k_f / c->M; /* of eq (3) in motion */
    D[V_][P_A] = c->A_A / c->M;
    D[V_][P_B] = -c->A_B / c->M;
    for (int side = 0; side < 2; side++) {
        const int s = P_A + side, t = T_A + side;
        const double sign = sign_of(side), own_u = sign * u, x = sign * y[X_], v = sign * y[V_], P = y[s];
        const Chamber chamber = chamber_of(c, side);
        double T = y[t], by_x[2], by_v[2], by_P[2], by_T[2], by_k[2], m_in, m_out;
        if (lane.full == 0) T = temperature(P, P_0, T_0, lane.a);
        chamber_flows(own_u, P, T, side, plant, &m_in, &m_out); /* they do not depend on x and v */
        rates_with_flows(m_in, m_out, x + dx, v, P, T, chamber, plant, &lane, by_x);
        rates_with_flows(m_in, m_out, x, v + DV, P, T, chamber, plant, &lane, by_v);
        chamber_rates(own_u, x, v, P + dP, T, chamber, plant, &lane, by_P);
        D[s][X_] = sign * ((by_x[0] - dy[s]) / dx);
        D[s][V_] = sign * ((by_v[0] - dy[s]) / DV);
        D[s][s] = limited((by_P[0] - dy[s]) / dP, 1 / f->h);
        if (lane.full != 0) {
            chamber_rates(own_u, x, v, P, T + DT, chamber, plant, &lane, by_T);
            D[t][X_] = sign * (by_x[1] - dy[t]) / dx;
            D[t][V_] = sign * (by_v[1] - dy[t]) / DV;
            D[t][s] = limited((by_P[1] - dy[t]) / dP, T_0 / P_0 / f->h);
            D[s][t] = (by_T[0] - dy[s]) / DT;
            D[t][t] = limited((by_T[1] - dy[t]) / DT, 1 / f->h);
        }
        if (f->model->estimates_k_0) {
            rates_with_flows(m_in, m_out, x, v, P, T, chamber, plant, &other, by_k);
            D[s][LN_K_0] = (by_k[0] - dy[s]) / DK;
            D[t][LN_K_0] = (by_k[1] - dy[t]) / DK;
        }
    }
}

/* Pressures between half the atmosphere's and twice the supply's, temperatures between half and twice T_0, k_0 within
   a factor of ten of its first value. */
static void keep_possible(double *y, const Plant *plant) {
    const Conditions *c = &plant->conditions;
    for (int s = P_A; s <= P_B; s++) y[s] = smaller(2 * c->P_s, larger(c->P_atm / 2, y[s]));
    for (int s = T_A; s <= T_B; s++) y[s] = smaller(2 * c->T_0, larger(c->T_0 / 2, y[s]));
    y[LN_K_0] = limited(y[LN_K_0], K_0_RANGE);
}

/* Product of two matrices, of which the second may be transposed. */
static void product(Matrix first, Matrix second, bool transposed, Matrix result) {
    for (int i = 0; i < SIZE; i++)
        for (int j = 0; j < SIZE; j++) {
            result[i][j] = 0;
            for (int k = 0; k < SIZE; k++) result[i][j] += first[i][k] * (transposed ? second[j][k] : second[k][j]);
        }
}

/* Advance the estimate y and its covariance S by one sample; u is held over it. */
static void predict(double *y, Matrix S, double u, const Filter *f) {
    const double h = f->h, v = y[V_];
    Matrix D, F, FS;
    double rates[SIZE], middle[SIZE];
    derivatives(y, u, f, D, rates);
    for (int s = 0; s < SIZE; s++) middle[s] = y[s] + h / 2 * rates[s];
    model_rates(middle, u, f, rates);
    for (int s = 0; s < SIZE; s++) y[s] += h * rates[s];
    stopped(y, y + 1, v, &f->plant->cylinder);
    product(D, D, false, F);
    for (int i = 0; i < SIZE; i++)
        for (int j = 0; j < SIZE; j++) F[i][j] = (i == j ? 1.0 : 0.0) + h * D[i][j] + h * h / 2 * F[i][j];
    product(F, S, false, FS);
    product(FS, F, true, D);
    for (int i = 0; i < SIZE; i++)
        for (int j = 0; j <= i; j++) S[i][j] = S[j][i] = D[i][j];
    const Noise *noise = f->noise;
    const double force = noise->force / f->plant->cylinder.M;
    const double T_noise = noise->pressure * f->plant->conditions.T_0 / f->plant->conditions.P_0;
    S[V_][V_] += h * (force * force);
    for (int side = 0; side < 2; side++) {
        S[P_A + side][P_A + side] += h * (noise->pressure * noise->pressure);
        if (f->model->lane.full != 0) S[T_A + side][T_A + side] += h * (T_noise * T_noise);
    }
    if (f->model->estimates_k_0) S[LN_K_0][LN_K_0] += h * (K_0_NOISE * K_0_NOISE);
    keep_possible(y, f->plant);
}

/* Correct the estimate and its covariance by a reading of state s; NaN was not taken. */
static void correct(double *y, Matrix S, int s, double measured, double variance) {
    if (measured != measured) return;
    const double sum = S[s][s] + variance, difference = measured - y[s];
    double gain[SIZE];
    for (int i = 0; i < SIZE; i++) gain[i] = S[i][s] / sum;
    for (int i = 0; i < SIZE; i++) {
        y[i] += gain[i] * difference;
        for (int j = 0; j <= i; j++) S[i][j] = S[j][i] = S[i][j] - gain[i] * gain[j] * sum;
    }
}

void kalman_filter(const double *x, const double *P, const double *u, const double *first, int64_t samples,
                   const FilterModel *model, const Plant *plant, const Noise *noise, double h, double *estimates,
                   double *variances) {
    const Filter f = {plant, model, noise, h};
    double y[SIZE] = {samples > 0 ? x[0] : 0, 0, first[0], first[1], plant->conditions.T_0, plant->conditions.T_0, 0};
    Matrix S = {{0}}; /* temperatures and k_0 that are not estimated are constant and coupled to nothing */
    S[X_][X_] = noise->x_variance;
    S[V_][V_] = 1e-6;
    for (int side = 0; side < 2; side++) {
        S[P_A + side][P_A + side] = FIRST_PRESSURE * FIRST_PRESSURE;
        S[T_A + side][T_A + side] = FIRST_TEMPERATURE * FIRST_TEMPERATURE;
    }
    S[LN_K_0][LN_K_0] = FIRST_LN_K_0 * FIRST_LN_K_0;
    for (int64_t k = 0; k < samples; k++) {
        correct(y, S, X_, x[k], noise->x_variance);
        for (int side = 0; side < 2; side++) correct(y, S, P_A + side, P[2 * k + side], noise->pressure_variance);
        keep_possible(y, plant);
        memcpy(estimates + SIZE * k, y, sizeof y);
        for (int s = 0; s < SIZE; s++) variances[SIZE * k + s] = S[s][s];
        predict(y, S, u[k], &f);
    }
}

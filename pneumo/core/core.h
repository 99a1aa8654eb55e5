/* Types and functions of the compiled core. Structs mirror the named tuples of the same name in Python; cffi reads
   this file, so what it does not understand is in maths.h and rates.h. All quantities are in SI units. */

typedef struct { double R, gamma, sonic_coefficient, critical_ratio; bool elliptic; } Gas;
/* Openings of the four paths, V: the area over k_xu, at the knots of a chamber's own command; without knots, that
   command. A b of 0 is that of the gas. */
enum { KNOTS = 64 };
typedef struct { int64_t knots; double u[KNOTS], supply[2][KNOTS], exhaust[2][KNOTS], b[2][2]; } Paths;
typedef struct { double k_xu, u_max, laminar, exhaust, leak; bool net_leak; Paths paths; } Valve;
typedef struct { double P_s, P_atm, T_in, T_amb, P_0, T_0; } Conditions;
typedef struct {
    double bore, stroke, A_A, A_B, V_d_A, V_d_B, M, k_f, x_min, x_max;
    bool rests;
    double load, coulomb, spring;
} Cylinder;
typedef struct { double e_A, e_PT; } WallLaw;
typedef struct { Gas gas; Valve valve; Conditions conditions; Cylinder cylinder; double k_0; WallLaw wall; double sag; } Plant;
typedef struct { bool closed_loop; double k_p, x_reverse; bool toggles, each_stage; double late; } Drive;
typedef struct { bool exact, held, next_at_end; double delay[3]; int64_t every; } Sampling;
enum { SUPPLY_LINE_MS = 10 }; /* time constant of the volume behind a supply that sags */
enum { STAGES = 6 }; /* of Dormand and Prince's method */
typedef struct { double n_V, n_in, n_out, a, mixing, flow_scale, wall_scale, e_A, e_PT, full; } Lane;
typedef struct { double force, pressure, x_variance, pressure_variance; } Noise;
typedef struct { bool estimates_k_0; Lane lane; } FilterModel;

/* A run whose signals are replayed; arrays as in `pneumo.simulation.full_order.Recording`. */
typedef struct {
    const double *states, *reference, *u, *u_B; /* u_B: NULL where it is -u */
    Drive drive;
    Plant plant;
    double h;
    const int8_t *halvings;
    int most_halvings;
    int64_t steps;
} Recording;

/* Lanes side by side, for the vector kernels: a row holds one number of each lane. */
enum { WIDTH = 8, ROW = 136 };
typedef struct {
    double n_V[ROW], a_half[ROW], in[ROW], in_T[ROW], out[ROW], wall[ROW], wall_A[ROW], wall_APT[ROW];
    double p[ROW], ln_p[ROW], root_T[ROW], heat[ROW]; /* within one stage; pressures are over P_0 */
    double now[2][ROW], k[2][7][ROW]; /* by chamber: pressure, rates of one step */
    double sum[2][2][ROW], squares[2][2][ROW]; /* by chamber: of errors, each before the carry of its rounding */
    double before[2][ROW], after[2][ROW], coarse[2][ROW], largest[2][ROW]; /* while a step is halved */
    double start[2][ROW], at_port[2][ROW]; /* of a part; its error where it is implicit, else -1 */
    int64_t count, polytropic, heated, heated_PT; /* lanes, padded; first lane with each kind of term */
    int64_t fresh; /* whether the last rates k[.][6] are those at the start of the next step */
    double inputs[4]; /* at which they were computed */
} Lanes;

/* Lanes that follow one after another, by the equations themselves. `y` (lane, chamber, 2) has the first pressures and
   temperatures, and then the last; `moments` (lane, chamber, 2) are sums of errors and of their squares, `failure`
   (lane, chamber) the steps at which a state was not positive, or -1; `pressure` (lane, chamber, stored). */
typedef struct {
    const Lane *lanes;
    int64_t count, stride;
    double *y, *moments;
    int64_t *failure;
    double *pressure;
    double *step; /* (lane, chamber, 3): pressure and temperature before a step, and its error, or -1 once it is accurate */
} LanesInTurn;

/* Signals of a fit's sets, by step and stage, and their plant; its flow's polynomial; the sets end before lane `end`. */
typedef struct { const double *u, *P_s, *motion, *psi; int64_t terms, end; Plant plant; } Inputs;

/* What the vector kernels need of a fit's sets of parameters beside `Lanes`. */
enum { MOST_TERMS = 18 };
typedef struct {
    double volume_ratio[ROW], expansion[ROW], ln_port[ROW], inward[ROW], outward[ROW], wall[ROW], wall_A[ROW]; /* at one stage */
    double p_port[2][ROW], supplied[2][ROW], p_port_before[ROW]; /* `supplied` is 1 where the port is the supply's, else 0 */
    double psi[MOST_TERMS][ROW], sonic[ROW], s_sonic[ROW]; /* of the inputs' gases */
    double inlet[ROW], exhaust[ROW]; /* temperature of the supply over T_0; exhaust over the plant's */
    double margin[2][ROW], reach[2][ROW], weight[2][ROW]; /* of a step that comes near the port's pressure */
    double beyond[2][ROW], T[2][ROW], rate_T[2][3][ROW];
} Sets;

void fill_tables(void); /* of the elementary functions: to be called once, before all else */
double core_log(double x);
double core_exp(double x);
double core_pow(double x, double y);

void chamber_rate(double u, double x, double v, double P, double T, int side, const Plant *plant, const Lane *lane,
                  double *rates);
void run(const double *y_0, double *reference, const double *u_B, int64_t steps, double force, const Drive *drive, const Plant *plant,
         double h, int most_halvings, double *states, int8_t *halvings);
void supplied_mass(const double *states, const double *u, const double *u_B, int64_t steps, const Plant *plant, double h,
                   double *m);

void replay_scalar(const Recording *recording, const Sampling *sampling, const LanesInTurn *lanes);
void start_lanes(Lanes *W, const Lane *lanes, int64_t count, const Plant *plant);
void replay_lanes(const Recording *recording, const Sampling *sampling, int64_t first, int64_t end, Lanes *W,
                  const double *psi, int terms, double *pressure, const LanesInTurn *in_turn);

void replay_sets(Inputs *inputs, int64_t count, int64_t steps, Lanes *W, Sets *X, bool full, int64_t stride, double h,
                 double *pressure);
void replay_flows(const double *motion, const double *flow, int64_t steps, const Lane *lanes, int64_t count,
                  const double *V_d, int64_t stride, const Plant *plant, double h, double *pressure);

void closed_chambers(const double *P, const double *measured, const bool *closed, const double *V,
                     const double *area_ratio, int64_t samples, double h, const double *start, double n,
                     const double *k, double e_A, double e_PT, double leak, double R, double gamma, double T_wall,
                     double PT_0, double *pressure);
void filter_first_order(double *signal, int64_t rows, int64_t samples, const double *start, double now, double before,
                        double decay);
void kalman_filter(const double *x, const double *P, const double *u, const double *first, int64_t samples,
                   const FilterModel *model, const Plant *plant, const Noise *noise, double h, double *estimates,
                   double *variances);

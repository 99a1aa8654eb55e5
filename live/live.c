/* The core for the page in the browser: arrays that the page fills and reads, a full-order run, and replays on it. */
#include "maths.h"

#define EXPORT(name) __attribute__((export_name(#name))) name
enum { MOST_STEPS = 23000, MOST_LANES = 80, MOST_HALVINGS = 6, MOST_PRESSURES = 100000 };

static double numbers[35]; /* of the plant, in the order of its named tuples, without `paths`; last the linearity */
static double reference[MOST_STEPS + 1], states[6 * (MOST_STEPS + 1)]; /* the first state is given */
static double moments[4 * MOST_LANES], pressure[MOST_PRESSURES], psi[40]; /* psi: polynomial of the subsonic flow */
static Lane lanes[MOST_LANES];

static int8_t halvings[MOST_STEPS];
static Drive drive;

void *EXPORT(place)(int array)
{
    void *places[] = {numbers, reference, states, moments, pressure, lanes, psi};
    return places[array];
}

void EXPORT(start)(void) { fill_tables(); }

double EXPORT(logarithm)(double x) { return core_log(x); }

/* Openings of a valve that is `off` from linear at half its largest command, as `Valve.with_linearity` has them. */
static void bend(Valve *valve, double off)
{
    static const double ends[] = {1.0 / 64, 1.0 / 32, 1.0 / 16, 1.0 / 8, 1.0 / 4, 1.0 / 2, 3.0 / 4, 1.0};
    enum { ENDS = sizeof ends / sizeof *ends };
    Paths *paths = &valve->paths;
    paths->knots = 2 * ENDS + 1;
    for (int i = 0; i < ENDS; i++) {
        const double u = ends[i] * valve->u_max, opening = u * (1 + 4 * off * (1 - ends[i]));
        paths->u[ENDS + 1 + i] = u;
        paths->u[ENDS - 1 - i] = -u;
        for (int side = 0; side < 2; side++) {
            paths->supply[side][ENDS + 1 + i] = opening;
            paths->exhaust[side][ENDS - 1 - i] = valve->exhaust * opening;
        }
    }
}

static Plant plant(void)
{
    const double *p = numbers, *c = numbers + 17;
    Plant of_numbers = {
        .gas = {p[0], p[1], p[2], p[3], p[4] != 0},
        .valve = {.k_xu = p[5], .u_max = p[6], .laminar = p[7], .exhaust = p[8], .leak = p[9], .net_leak = p[10] != 0},
        .conditions = {p[11], p[12], p[13], p[14], p[15], p[16]},
        .cylinder = {c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8], c[9], c[10] != 0, c[11], c[12], c[13]},
        .k_0 = c[14],
        .wall = {c[15], c[16]},
    };
    if (p[34] != 0) bend(&of_numbers.valve, p[34]);
    return of_numbers;
}

void EXPORT(simulate)(int steps, double h, int closed_loop, double k_p, double x_reverse)
{
    const Plant its_plant = plant();
    double y_0[6];
    for (int i = 0; i < 6; i++) y_0[i] = states[i];
    drive = (Drive){.closed_loop = closed_loop != 0, .k_p = k_p, .x_reverse = x_reverse, .each_stage = true};
    run(y_0, reference, NULL, steps, 0, &drive, &its_plant, h, MOST_HALVINGS, states, halvings);
}

/* Replay lanes on the last run, which may be of another plant; they start at its first pressures and temperatures. */
void EXPORT(replay)(int count, int steps, double h, int stride)
{
    static double y[4 * MOST_LANES], step[6 * MOST_LANES];
    static int64_t failure[2 * MOST_LANES];
    const Recording recording = {states, reference, reference, NULL, drive, plant(), h, halvings, MOST_HALVINGS, steps};
    const Sampling exact = {.exact = true, .every = 1};
    for (int i = 0; i < 4 * count; i++) y[i] = states[2 + i % 4];
    const LanesInTurn all = {lanes, count, stride, y, moments, failure, pressure, step};
    replay_scalar(&recording, &exact, &all);
}

/* The same for reduced models side by side, in the order of what they need, faster. */
void EXPORT(replay_together)(int count, int steps, double h, int stride, int terms)
{
    enum { BLOCK = 250 };
    static Lanes together;
    static double block[BLOCK * 2 * MOST_LANES];
    const int stored = steps / stride + 1, padded = (count + WIDTH - 1) / WIDTH * WIDTH;
    const Recording recording = {states, reference, reference, NULL, drive, plant(), h, halvings, MOST_HALVINGS, steps};
    const Sampling exact = {.exact = true, .every = 1};
    const LanesInTurn none = {.stride = 1};
    memset(&together, 0, sizeof together);
    start_lanes(&together, lanes, count, &recording.plant);
    for (int side = 0; side < 2; side++)
        for (int i = 0; i < ROW; i++) together.now[side][i] = states[2 + 2 * side] / recording.plant.conditions.P_0;
    for (int i = 0; i < 2 * count; i++) pressure[i * stored] = states[2 + 2 * (i % 2)];
    for (int first = 0; first < steps; first += BLOCK) {
        const int end = first + BLOCK < steps ? first + BLOCK : steps;
        replay_lanes(&recording, &exact, first, end, &together, psi, terms, block, &none);
        for (int k = first + 1; k <= end; k++)
            for (int i = 0; i < 2 * count && k % stride == 0; i++)
                pressure[i * stored + k / stride] = block[((k - 1 - first) * 2 + i % 2) * padded + i / 2];
    }
    for (int i = 0; i < 4 * count; i++)
        moments[i] = (i % 2 ? together.squares : together.sum)[i / 2 % 2][0][i / 4];
}

int memcmp(const void *a, const void *b, size_t count)
{
    const unsigned char *one = a, *other = b;
    while (count && *one == *other) one++, other++, count--;
    return count ? *one - *other : 0;
}

/* replay.c: start from the first measured pressures, then use u, x and v only. */
#include <stdio.h>
#include "rig.h"

int main(void)
{
    double row[5], next[5], state[M7_STATES];
    FILE *file = fopen("held_out.txt", "r");
    if (!file || fscanf(file, "%lf %lf %lf %lf %lf", row, row + 1, row + 2, state, state + 1) != 5)
        return 1;
    while (fscanf(file, "%lf %lf %lf %lf %lf", next, next + 1, next + 2, next + 3, next + 4) == 5) {
        double end[M7_INPUTS] = {row[0], next[1], next[2]}; /* the command is held */
        if (M7_step(&M7_defaults, row, end, 1e-3, state))
            return 1;
        printf("%.9g %.9g\n", state[M7_P_A], state[M7_P_B]);
        for (int i = 0; i < 3; i++)
            row[i] = next[i];
    }
    return fclose(file);
}

/* The plan's torques and states, which are polynomials on each piece. */

#include "mpc_layout.h"

/* Return the last piece that begins at or before the clock. */
static int piece_of(const mpc_task *task, double clock)
{
    int first = 0, end = task->pieces;
    while (end - first > 1) {
        const int middle = (first + end) / 2;
        if (task->times[middle] <= clock) {
            first = middle;
        } else {
            end = middle;
        }
    }
    return first;
}

void mpc_planned(const mpc_task *task, double clock, double t, int first, int end, double *values)
{
    const int piece = piece_of(task, clock), powers = task->powers;
    const double least = task->times[0], most = task->times[task->pieces];
    const double at = (t < least ? least : t > most ? most : t) - task->times[piece];
    const double *row =
        task->plan + ((size_t)piece * (size_t)channels_of(task) + (size_t)first) * (size_t)powers;
    for (int c = first; c < end; c++, row += powers) {
        double value = row[powers - 1];
        for (int k = powers - 2; k >= 0; k--) {
            value = value * at + row[k];
        }
        values[c - first] = value;
    }
}

/* The body's motion under the plan's torques and a correction, and its derivatives with respect to
   the correction. */

#include <math.h>
#include <string.h>

#include "mpc_layout.h"

static const double NODES[4] = {0.0, 0.5, 0.5, 1.0};
static const double WEIGHTS[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};

/* Compute the rates at x and, if slopes are wanted, their Jacobian with respect to (x, correction);
   return 0 if all numbers are finite. */
int mpc_node(mpc_motion *motion, double t, const double *x, const double *correction, int slopes)
{
    const mpc_task *task = motion->task;
    const int m = task->tail, states = states_of(task), zeta = arguments_of(task);
    const double *rates = x + MPC_ATTITUDE + m;
    mpc_planned(task, t, t, 0, m, motion->tau);
    for (int a = 0; a < m; a++) {
        motion->tau[a] += correction[a] - task->damping * rates[a];
    }
    if (!slopes) {
        return task->rates(task->parameters, x, motion->tau, motion->h, motion->y, motion->work);
    }
    const int failed = task->slopes(task->parameters, x, motion->tau, motion->h, motion->y,
                                    motion->J, motion->work);
    for (int i = 0; i < states + MPC_TURN; i++) {
        double *row = motion->J + (size_t)i * (size_t)zeta;
        for (int a = 0; a < m; a++) {
            row[MPC_ATTITUDE + m + a] -= task->damping * row[states + a];
        }
    }
    return failed;
}

/* K = J_x S_at; J_tau is added in the columns of interval block. */
static void turn_slopes(mpc_motion *motion, int block, int columns)
{
    const mpc_task *task = motion->task;
    const int m = task->tail, states = states_of(task), zeta = arguments_of(task);
    const size_t n = (size_t)motion->variables;
    for (int i = 0; i < states; i++) {
        const double *J = motion->J + (size_t)i * (size_t)zeta;
        double *row = motion->K + (size_t)i * n;
        for (int c = 0; c < columns; c++) {
            row[c] = 0.0;
        }
        for (int j = 0; j < states; j++) {
            const double factor = J[j], *S = motion->S_at + (size_t)j * n;
            for (int c = 0; c < columns; c++) {
                row[c] += factor * S[c];
            }
        }
        for (int a = 0; a < m; a++) {
            row[block * m + a] += J[states + a];
        }
    }
}

/* to = from + factor * slope, for matrices whose rows begin apart numbers after each other. */
static void shift(int rows, int columns, size_t apart, const double *from, double factor,
                  const double *slope, double *to)
{
    for (int i = 0; i < rows; i++) {
        for (int c = 0; c < columns; c++) {
            to[c] = from[c] + factor * slope[c];
        }
        from += apart;
        slope += apart;
        to += apart;
    }
}

int mpc_step(mpc_motion *motion, double t, double h, const double *correction, int block,
             int columns)
{
    const int states = states_of(motion->task);
    const size_t n = (size_t)motion->variables;
    memcpy(motion->x_at, motion->x, (size_t)states * sizeof(double));
    memcpy(motion->sum, motion->x, (size_t)states * sizeof(double));
    if (columns > 0) {
        memcpy(motion->S_at, motion->S, (size_t)states * n * sizeof(double));
        memcpy(motion->S_sum, motion->S, (size_t)states * n * sizeof(double));
    }
    for (int s = 0; s < 4; s++) {
        if (mpc_node(motion, t + NODES[s] * h, motion->x_at, correction, columns > 0) != 0) {
            return 1;
        }
        const double *k = motion->y;
        shift(1, states, 0, motion->sum, WEIGHTS[s] * h, k, motion->sum);
        if (columns > 0) {
            turn_slopes(motion, block, columns);
            shift(states, columns, n, motion->S_sum, WEIGHTS[s] * h, motion->K, motion->S_sum);
        }
        if (s < 3) {
            const double part = NODES[s + 1] * h;
            shift(1, states, 0, motion->x, part, k, motion->x_at);
            if (columns > 0) {
                shift(states, columns, n, motion->S, part, motion->K, motion->S_at);
            }
        }
    }
    memcpy(motion->x, motion->sum, (size_t)states * sizeof(double));
    if (columns > 0) {
        memcpy(motion->S, motion->S_sum, (size_t)states * n * sizeof(double));
    }
    for (int i = 0; i < states; i++) {
        if (!isfinite(motion->x[i])) {
            return 1;
        }
    }
    return 0;
}

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

/* Turn column c of S_at into its slope J_x S_at, plus J_tau of coordinate a if a >= 0; add weight
   times that to S_sum, and let S_at be S plus part times that. */
static void turn_column(mpc_motion *motion, int c, int a, double weight, double part)
{
    const mpc_task *task = motion->task;
    const int m = task->tail, states = states_of(task), zeta = arguments_of(task);
    const double *S = motion->S + c * states;
    double *at = motion->S_at + c * states, *sum = motion->S_sum + c * states;
    const double *J = motion->J;
    for (int i = 0; i < states; i++, J += zeta) {
        double slope = a < 0 ? 0.0 : J[states + a];
        if (i >= MPC_ATTITUDE && i < MPC_ATTITUDE + m) { /* a coordinate's rate is a state */
            slope = at[i + m];
        } else {
            for (int j = 0; j < states; j++) {
                slope += J[j] * at[j];
            }
        }
        motion->row[i] = slope;
    }
    for (int i = 0; i < states; i++) {
        sum[i] += weight * motion->row[i];
        at[i] = S[i] + part * motion->row[i];
    }
}

int mpc_step(mpc_motion *motion, double t, double h, const double *correction, int block,
             int columns)
{
    const int states = states_of(motion->task);
    const int m = motion->task->tail;
    const size_t size = (size_t)(columns * states) * sizeof(double);
    memcpy(motion->x_at, motion->x, (size_t)states * sizeof(double));
    memcpy(motion->sum, motion->x, (size_t)states * sizeof(double));
    memcpy(motion->S_at, motion->S, size);
    memcpy(motion->S_sum, motion->S, size);
    for (int s = 0; s < 4; s++) {
        if (mpc_node(motion, t + NODES[s] * h, motion->x_at, correction, columns > 0) != 0) {
            return 1;
        }
        const double weight = WEIGHTS[s] * h, part = s < 3 ? NODES[s + 1] * h : 0.0;
        for (int i = 0; i < states; i++) {
            motion->sum[i] += weight * motion->y[i];
            motion->x_at[i] = motion->x[i] + part * motion->y[i];
        }
        for (int c = 0; c < columns; c++) {
            turn_column(motion, c, c < block * m ? -1 : c - block * m, weight, part);
        }
    }
    memcpy(motion->x, motion->sum, (size_t)states * sizeof(double));
    memcpy(motion->S, motion->S_sum, size);
    for (int i = 0; i < states; i++) {
        if (!isfinite(motion->x[i])) {
            return 1;
        }
    }
    return 0;
}

/* Declarations that the files of the controller share, and sizes. */

#ifndef MPC_INSIDE_H
#define MPC_INSIDE_H

#include "mpc.h"

/* Arrays of a tick: x and S = dx / d(correction) along the motion, and workspace. */
typedef struct {
    const mpc_task *task;
    int variables;               /* n = N m, numbers of the correction */
    double begin, width;         /* s, start of the correction, length of an interval */
    const double *correction;    /* (N, m) */
    double h[3];                 /* angular momentum */
    double *x, *S;               /* (states), (states, n) */
    double *x_at, *S_at;         /* the same at a Runge-Kutta stage */
    double *sum, *S_sum, *K;     /* weighted sums of the stages; slope of S */
    double *y, *J, *tau, *table, *row, *work;
} mpc_motion;

/* The program of a correction: the sum of squares and its derivatives. */
typedef struct {
    double cost;
    double *g, *H; /* (n), (n, n); NULL if only the cost is wanted */
} mpc_program;

static inline int states_of(const mpc_task *task)
{
    return MPC_ATTITUDE + 2 * task->tail;
}

static inline int arguments_of(const mpc_task *task)
{
    return states_of(task) + task->tail;
}

static inline int channels_of(const mpc_task *task)
{
    return task->tail + states_of(task);
}

/* plan.c: evaluate the plan's channels first to end - 1 at t, by the piece that contains clock */
void mpc_planned(const mpc_task *task, double clock, double t, int first, int end, double *values);

/* motion.c: make one Runge-Kutta step of length h from motion->x at t under a correction, the one
   of interval block, with S if columns > 0; return 0 if all numbers are finite */
int mpc_step(mpc_motion *motion, double t, double h, const double *correction, int block,
             int columns);
int mpc_node(mpc_motion *motion, double t, const double *x, const double *correction, int slopes);

/* least_squares.c: compute the cost of a motion from x0, with derivatives if the program has arrays for
   them; return 0 if all numbers are finite */
int mpc_program_of(mpc_motion *motion, const double *x0, mpc_program *program);

#endif

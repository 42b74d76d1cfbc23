/* Sizes, and what the files of the controller share. */

#ifndef MPC_INSIDE_H
#define MPC_INSIDE_H

#include "mpc.h"

/* Where a tick keeps what: x and S = dx / d(correction) along the motion, and its program. */
typedef struct {
    const mpc_task *task;
    int variables;               /* n of the correction, N m */
    double begin, width;         /* s, of the correction and of its intervals */
    const double *correction;    /* (N, m) */
    double h[3];                 /* angular momentum */
    double *x, *S;               /* (states), (states, n) */
    double *x_at, *S_at;         /* of a Runge-Kutta stage */
    double *sum, *S_sum, *K; /* of its slopes */
    double *y, *J, *tau, *table, *row, *work;
} mpc_motion;

/* The program of a correction: the sum of squares, and its derivatives. */
typedef struct {
    double cost;
    double *g, *H; /* (n), (n, n), NULL where only the cost is wanted */
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

/* plan.c: the plan's channels at t, those from first to before end, t in the piece of clock */
void mpc_planned(const mpc_task *task, double clock, double t, int first, int end, double *values);

/* motion.c: from motion->x at t by steps of h each under correction block (NULL: that which acts),
   with S where columns > 0; 0 where all is finite */
int mpc_step(mpc_motion *motion, double t, double h, const double *correction, int block,
             int columns);
int mpc_node(mpc_motion *motion, double t, const double *x, const double *correction, int slopes);

/* program.c: the cost of a motion from x0, with derivatives where the program has room for them; 0
   where all is finite */
int mpc_program_of(mpc_motion *motion, const double *x0, mpc_program *program);

#endif

/* Declarations that the files of the controller share, and sizes. */

#ifndef MPC_INSIDE_H
#define MPC_INSIDE_H

#include "mpc.h"

static const double NONE = 1e30; /* no bound, no time */

/* Arrays of a tick: x and S = dx / d(correction) along the motion, and workspace. */
typedef struct {
    const mpc_task *task;
    int variables;               /* n = N m, numbers of the correction */
    double begin, width;         /* s, start of the correction, length of an interval */
    const double *correction;    /* (N, m) */
    double h[3];                 /* angular momentum */
    double *x, *S;               /* (states), (n, states): S by columns */
    double *x_at, *S_at;         /* the same at a Runge-Kutta stage */
    double *sum, *S_sum;         /* weighted sums of the stages */
    double *extreme, *S_extreme; /* (N 2m), (N 2m, n): largest angles and rates of each interval */
    double *y, *J, *tau, *table, *row, *work;
} mpc_motion;

/* The program of a correction: the sum of squares |R d + c|^2 / 2 + constant, near the correction. */
typedef struct {
    double cost, off; /* at d = 0; square of the distance from the target */
    double *c, *R;    /* (n), (n, n), upper triangle; NULL if only the cost is wanted */
} mpc_program;

/* The arrays of a tick. */
typedef struct {
    mpc_motion motion;
    mpc_program program;
    mpc_bounded qp;
    double *x0, *fresh, *trial;
    double *lower, *upper; /* (n): bounds of the correction */
    double *limit;         /* (N 2m): bounds of the tail that can hold */
    double *low, *high;    /* (n + N 2m): bounds of the quadratic program */
} mpc_workspace;

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

/* quadratic.c: compute the rotation that turns (a, b) into (norm, 0); return the norm */
double mpc_rotation(double a, double b, double *cosine, double *sine);

/* gauss_newton.c: compute bounds of each number of the correction: those of the torque minus the
   plan's torque, at both ends of all Runge-Kutta steps in its interval */
void mpc_write_bounds(mpc_workspace *w);
double mpc_between(double value, double lower, double upper);
/* compute bounds of the quadratic program from a correction.  A bound of the tail that no torque can
   keep is widened to what can be reached, in the first interval at least to the state's own value.
   Return whether one was */
int mpc_write_limits(mpc_workspace *w, const double *correction);
/* lower the sum of squares, plus the price of what exceeds bounds, by one Gauss-Newton step from the
   correction; return 0 for success, MPC_FAR if the correction's own motion is not finite */
enum { MPC_FAR = 2 };
int mpc_improve(mpc_state *state, mpc_workspace *w, double *correction);

#endif

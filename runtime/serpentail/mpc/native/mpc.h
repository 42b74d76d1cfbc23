/* Model-predictive control of a flight: each tick makes Gauss-Newton steps towards the torques that
   bring the body from its measured state to a plan's goal.

   The torques are the plan's plus a correction, which is constant in each of N intervals between
   the tick and the end of the horizon.  A tick integrates the motion by classical Runge-Kutta steps
   with exact derivatives.  It states the sum of squares to be minimised as a quadratic program with
   bounds of the torques and of the tail's angles and rates, solves that by an active-set method, and
   keeps the step if it lowers the sum.  Its work is bounded: by the task's steps and iterations, by
   MPC_TRIALS motions for each step, and by mpc_most_changes of a quadratic program.

   Nothing is allocated: the caller provides mpc_memory_size(task) doubles.  SI units; quaternions
   are w, x, y, z, torso to world. */

#ifndef MPC_H
#define MPC_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A model's functions of an airborne state x = (quaternion, tail coordinates, their rates).
   y = (rates of x, omega); J = dy / d(x, tau), row by row; h: the conserved angular momentum in
   world axes.  They return 0 if all results are finite. */
typedef int (*mpc_rates)(const void *parameters, const double *x, const double *tau,
                         const double *h, double *y, double *work);
typedef int (*mpc_slopes)(const void *parameters, const double *x, const double *tau,
                          const double *h, double *y, double *J, double *work);
/* Linear and angular momentum (3 numbers each) at q, v. */
typedef int (*mpc_momentum)(const void *parameters, const double *q, const double *v,
                            double *linear, double *angular, double *work);

enum { MPC_ATTITUDE = 4, MPC_TURN = 3 }; /* sizes of a quaternion and of omega */
enum { MPC_TRIALS = 3 };                 /* a step is tried whole, halved, and halved again */

/* What happened at a tick: a sum of these. */
enum {
    MPC_SECOND = 1, /* the end was far off after a step: there were more */
    MPC_LIMIT = 2,  /* a quadratic program ended at its limit of changes */
    MPC_BOUND = 4,  /* an angle or a rate of the tail is, or will be, beyond its bound */
    MPC_MISS = 8,   /* the end is predicted to miss the target */
    MPC_KEPT = 16,  /* the tick failed, as at a state that is not finite: the last torques stay */
    MPC_OPEN = 32   /* it failed, and no correction acts: the torques are the plan's */
};

/* The task of a controller; its arrays may be in constant memory. */
typedef struct {
    int tail;             /* number of tail coordinates, called m below */
    int intervals, steps; /* number N of intervals; Runge-Kutta steps in each */
    int late_steps;       /* Runge-Kutta steps from a tick until its torques act; 0: no delay */
    int iterations;       /* most Gauss-Newton steps in a tick */
    int goal_rows;        /* rows of the attitude's goal at the end */
    int pieces, powers;   /* of the plan's polynomials */
    int work;             /* size of the workspace of the model's functions, in doubles */
    double period, delay; /* s: between ticks, and from a tick until its torques act */
    double horizon;       /* s: of a tick; it ends with the plan at the latest */
    double end, last;     /* s: end of the plan; time of the last tick */
    double damping;       /* N m s, of the joints, in addition to the torques */

    mpc_rates rates;
    mpc_slopes slopes;
    mpc_momentum momentum;
    const void *parameters; /* of the model */
    const double *times;    /* (pieces + 1) s */
    const double *plan;     /* (pieces, 3 m + 4, powers): torques, quaternion, tail, rates */

    const double *most_torque; /* (m) N m */
    const double *most_tail;   /* (2 m) rad, rad/s: bounds of the tail's coordinates and rates */
    double near, miss;         /* distances of the predicted end from the target, in units of the
                                  weights below: beyond near there is another step, beyond miss a
                                  flag */
    /* weights of squares, per second: the correction, and the tail's rates minus the plan's */
    const double *torque_weight, *rate_weight; /* (m) */
    /* at the end of the plan: the remaining rotation (rad) to the goal, and (tail, rates, omega)
       minus the goal's; free entries have weight 0 */
    double attitude_weight;
    const double *goal;       /* (goal_rows, 4): rows that are 0 at the goal's quaternion */
    const double *end_state;  /* (2 m + 3) */
    const double *end_weight; /* (2 m + 3) */
    /* at the end of a shorter horizon: (tail, rates) minus the plan's */
    const double *track_weight; /* (2 m) */
} mpc_task;

/* The state of a controller. */
typedef struct {
    const mpc_task *task;
    double *memory;      /* mpc_memory_size(task) doubles */
    long tick;           /* number of the last tick, from the plan's start; -1: none yet */
    long ticks, failed;  /* number of ticks, and of those that failed */
    long steps, trials;  /* Gauss-Newton steps, and motions that were tried for them, in all ticks */
    long set_changes;    /* changes of the active set, in all ticks */
    int flags;           /* of the last tick */
    unsigned char *log;  /* NULL, or room for the flags of the first ticks */
    long room;           /* how many */
    int newest;          /* which of the two corrections is newer */
    double begin[2];     /* s, start of each correction; above all times if there is none */
    double width[2];     /* s, length of their intervals */
    double off;          /* distance of the end from the target that the last tick predicted */
} mpc_state;

size_t mpc_memory_size(const mpc_task *task);

/* Forget all ticks. */
void mpc_begin(mpc_state *state, const mpc_task *task, double *memory);

/* Compute a correction from q, v at t (s, from the plan's start), whether or not a tick is due.
   Returns 0 for success; 1 if the tick failed: it is counted, and the last correction stays.
   state->flags tells what happened. */
int mpc_tick(mpc_state *state, double t, const double *q, const double *v);

/* Torques (m) at t, N m; clock: the start of the time step that contains t, or t. */
void mpc_torque(const mpc_state *state, double clock, double t, double *tau);

/* Compute a correction from q, v if a tick is due at the clock, then the torques at t.  A tick that
   fails, as for a q that is not finite, is counted in state->failed, and the last correction stays. */
void mpc_control(mpc_state *state, double clock, double t, const double *q, const double *v,
                 double *tau);

/* A controller in a simulated run.  Ticks are at the starts of the integrator's steps, so that a
   trial state never counts as measured.  clock: the run's time at which the plan starts. */
typedef struct {
    mpc_state state;
    const double *step_begin; /* s, the run's time at its step's start; NULL: each call's t */
    double clock;
} mpc_simulation;

/* mpc_control, with the arguments of a controller in a simulated run; context: mpc_simulation.
   Returns 0. */
int mpc_simulated(void *context, double t, const double *q, const double *v, double *tau);

/* A strictly convex quadratic program: d (n) minimises |R d + c|^2 / 2, with bounds of the n
   variables and of A d (rows).  A row whose bound costs more than its price (cost per unit) is given
   up: then the sum of cost and price times excess is minimal. */
typedef struct {
    int n, rows, most;           /* most: limit of the changes of the active set */
    const double *R, *c, *A;     /* (n, n), upper triangle; (n); (rows, n) */
    const double *lower, *upper; /* (n + rows) */
    double price;
    double *d;      /* result */
    double paid;    /* result: largest multiplier of a row */
    double *memory; /* 2 n (n + 2) doubles */
    int *set;       /* 3 n + rows */
} mpc_bounded;

/* Solve it.  Returns the number of changes of the active set; most if there are so many, and d may
   then be beyond bounds; -1 if R is singular. */
int mpc_quadratic(mpc_bounded *program);

static inline int mpc_most_changes(int n)
{
    return 3 * n + 10;
}

#ifdef __cplusplus
}
#endif

#endif

/* Model-predictive control of a flight: each tick makes a Gauss-Newton step towards the torques
   that bring the body from its measured state to a plan's goal.

   The torques are the plan's plus a correction, which is constant in each of N intervals between
   the tick and the end of the horizon.  A tick integrates the motion by classical Runge-Kutta steps
   with exact derivatives.  It states the sum of squares to be minimised as a quadratic program with
   bounds, solves that by an active-set method, and keeps the step if it lowers the sum.

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

/* The task of a controller; its arrays may be in constant memory. */
typedef struct {
    int tail;             /* number of tail coordinates, called m below */
    int intervals, steps; /* number N of intervals; Runge-Kutta steps in each */
    int late_steps;       /* Runge-Kutta steps from a tick until its torques act; 0: no delay */
    int iterations;       /* Gauss-Newton steps in a tick */
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
    const double *most_angle;  /* (m) rad */
    /* weights of squares.  Per second: the correction, and the tail's rates minus the plan's.  At
       the end of each interval: the excess of angles over their bounds */
    const double *torque_weight, *rate_weight; /* (m) */
    double angle_weight;
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
    long set_changes;    /* changes of the active set, in all ticks */
    int newest;          /* which of the two corrections is newer */
    double begin[2];     /* s, start of each correction; above all times if there is none */
    double width[2];     /* s, length of their intervals */
    double cost;         /* the sum of squares after the last tick that did not fail */
} mpc_state;

size_t mpc_memory_size(const mpc_task *task);

/* Forget all ticks. */
void mpc_begin(mpc_state *state, const mpc_task *task, double *memory);

/* Compute a correction from q, v at t (s, from the plan's start), whether or not a tick is due.
   Returns 0 for success; 1 if the tick failed: it is counted, and the last correction stays. */
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

/* Find d (n) that minimises d^T H d / 2 + g^T d with lower <= d <= upper, lower <= 0 <=
   upper; H by rows, both triangles.  memory: n (n + 3) doubles, set: n ints.  Returns the number of
   changes of the active set; -1 if H is not positive definite, or after too many changes. */
int mpc_quadratic(int n, const double *H, const double *g, const double *lower,
                  const double *upper, double *d, int *set, double *memory);

#ifdef __cplusplus
}
#endif

#endif

/* Model-predictive control of a flight: at each tick a Gauss-Newton step towards the torques that
   bring the body from where it is to a plan's goal.

   Torques are the plan's and a correction, which is constant in each of N intervals between the
   tick and the end of the horizon.  A tick follows the motion by classical Runge-Kutta steps with
   exact derivatives, writes the sum of squares that the correction is to lower as a quadratic
   program with bounds, solves that by an active set, and keeps the step if it lowers the sum.

   Nothing is allocated: the caller gives as many doubles as mpc_memory_size tells.  SI units;
   quaternions are w, x, y, z, torso to world. */

#ifndef MPC_H
#define MPC_H

#include <stddef.h>

/* A model's functions of an airborne state x = (quaternion, tail, its rates): y = (rates of x,
   omega), J = dy / d(x, tau) by rows; the angular momentum h, world axes, is conserved.  0: all is
   finite. */
typedef int (*mpc_rates)(const void *parameters, const double *x, const double *tau,
                         const double *h, double *y, double *work);
typedef int (*mpc_slopes)(const void *parameters, const double *x, const double *tau,
                          const double *h, double *y, double *J, double *work);
/* Linear and angular momentum (3 each) of q, v. */
typedef int (*mpc_momentum)(const void *parameters, const double *q, const double *v,
                            double *linear, double *angular, double *work);

enum { MPC_ATTITUDE = 4, MPC_TURN = 3 }; /* sizes of a quaternion and of omega */

/* What the controller is made for; the arrays may lie in constant memory. */
typedef struct {
    int tail;             /* tail coordinates m */
    int intervals, steps; /* N of the correction, and Runge-Kutta's in each */
    int late_steps;       /* Runge-Kutta's from a tick until its torques act; 0: no delay */
    int iterations;       /* Gauss-Newton steps of a tick */
    int goal_rows;        /* of the attitude at the end */
    int pieces, powers;   /* of the plan's polynomials */
    int work;             /* doubles that the model's functions work on */
    double period, delay; /* s: between ticks, and from a tick until its torques act */
    double horizon;       /* s: of a tick, or what is left of the plan where that is less */
    double end, last;     /* s: of the plan; the last tick */
    double damping;       /* N m s, of the joints, beside the torques */

    mpc_rates rates;
    mpc_slopes slopes;
    mpc_momentum momentum;
    const void *parameters; /* of the model */
    const double *times;    /* (pieces + 1) s */
    const double *plan;     /* (pieces, 3 m + 4, powers): torques, quaternion, tail, its rates */

    const double *most_torque; /* (m) N m */
    const double *most_angle;  /* (m) rad */
    /* what squares cost: each second those of the correction and of the tail's rates less the
       plan's; at the ends of intervals those of angles beyond their bounds */
    const double *torque_weight, *rate_weight; /* (m) */
    double angle_weight;
    /* at the end of the plan: of the turn (rad) that is left, and of (tail, rates, omega) less the
       goal's, weights being 0 where it is free */
    double attitude_weight;
    const double *goal;       /* (goal_rows, 4): rows that are 0 at the goal's quaternion */
    const double *end_state;  /* (2 m + 3) */
    const double *end_weight; /* (2 m + 3) */
    /* at the end of a horizon that is shorter: of (tail, rates) less the plan's */
    const double *track_weight; /* (2 m) */
} mpc_task;

/* Where a controller is. */
typedef struct {
    const mpc_task *task;
    double *memory;      /* mpc_memory_size(task) doubles */
    long tick;           /* the last, counted from the plan's begin; -1: none yet */
    long ticks, failed;  /* how many there were, and how many of them failed */
    long set_changes;    /* of the active set, in all ticks */
    int newest;          /* which of two corrections is the newest */
    double begin[2];     /* s, of the corrections; above all times where there is none */
    double width[2];     /* s, of their intervals */
    double cost;         /* the sum of squares after the last tick that did not fail */
} mpc_state;

size_t mpc_memory_size(const mpc_task *task);

/* Forget all ticks. */
void mpc_begin(mpc_state *state, const mpc_task *task, double *memory);

/* Compute a correction from q, v at t (s, from the plan's begin), whatever the ticks' clock says.
   0: done; 1: the tick failed, and is counted: the last correction stays. */
int mpc_tick(mpc_state *state, double t, const double *q, const double *v);

/* Torques (m) at t, N m; clock: the begin of the time step that t lies in, or t. */
void mpc_torque(const mpc_state *state, double clock, double t, double *tau);

/* Both: where a tick is due at the clock, it is computed from q, v; then torques at t. */
void mpc_control(mpc_state *state, double clock, double t, const double *q, const double *v,
                 double *tau);

/* A controller in a simulated run, whose trial states must not count as measured: ticks are at the
   begins of its steps.  clock: the run's time at which the plan begins. */
typedef struct {
    mpc_state state;
    const double *step_begin; /* s, of the run's time; NULL: every call is one */
    double clock;
} mpc_simulation;

/* mpc_control, as a NativeTorque; context: an mpc_simulation.  Returns 0. */
int mpc_simulated(void *context, double t, const double *q, const double *v, double *tau);

/* quadratic.c: d (n) that minimises d^T H d / 2 + g^T d within lower <= 0 <= upper; H by rows, both
   triangles.  memory: n (n + 3) doubles, set: n ints.  Returns how often the active set changed, -1
   where H is not positive definite or it changed too often. */
int mpc_quadratic(int n, const double *H, const double *g, const double *lower,
                  const double *upper, double *d, int *set, double *memory);

#endif

/* Feedback along a planned flight: torques = the plan's + K e, within their bounds.

   e (n = 6 + 2 m) is the measured state minus the plan's: attitude (twice the vector part of the
   rotation from the planned one, about the torso's axes), angular velocity (rad/s, torso axes), tail
   coordinates (rad), their rates (rad/s).  K is constant from knot to knot.  A tick makes m n
   multiplications for K e, n (n + 3) / 2 for the flag, and about (3 m + 7) powers for the plan.

   Nothing is allocated: the caller provides gains_memory_size(task) numbers.  SI units; quaternions
   are w, x, y, z, torso to world. */

#ifndef GAINS_H
#define GAINS_H

#ifdef __cplusplus
extern "C" {
#endif

typedef double gains_real;

enum { GAINS_TORSO = 6, GAINS_PLANNED = 7 }; /* entries of e, and planned numbers, of the torso */

/* What a tick tells; their sum if several hold. */
enum {
    GAINS_FAILED = 1,    /* the state is not finite, or its quaternion has not norm 1: K e is left out */
    GAINS_SATURATED = 2, /* a torque was cut to its bound */
    GAINS_BEYOND = 4     /* e is as large as in a flight that ended wrong: make a new plan */
};

/* The plan and its gains; arrays may be in constant memory. */
typedef struct {
    int tail, knots;               /* number m of tail coordinates; of knots */
    int pieces, powers;            /* of the plan's polynomials */
    gains_real period;             /* s, between ticks */
    const gains_real *most_torque; /* (m) N m */
    const gains_real *times;       /* (pieces + 1) s */
    const gains_real *plan;        /* (pieces, 3 m + 7, powers): torques, quaternion, angular velocity,
                                      tail, its rates, by powers of the time since the piece's begin */
    const gains_real *begins;      /* (knots) s, from which their gains act */
    const gains_real *gains;       /* (knots, m, n): K */
    const gains_real *costs;       /* (knots, n (n + 1) / 2): C, row by row up to the diagonal */
    const gains_real *region;      /* (knots): e is inside while e^T C e is less */
} gains_task;

typedef struct {
    const gains_task *task;
    gains_real *memory;                      /* gains_memory_size(task) numbers */
    long ticks, failed, saturated, beyond; /* ticks in the flight; those that told each flag */
} gains_state;

int gains_memory_size(const gains_task *task);

/* Forget all ticks. */
void gains_begin(gains_state *state, const gains_task *task, gains_real *memory);

/* Compute the torques tau (m), N m, that are to act from t (s, from the plan's start) to the next
   tick, from q and v measured at t.  Joint damping belongs to the body.  After the plan's end tau is
   0.  Returns the sum of what it tells, 0 if all is well. */
int gains_tick(gains_state *state, gains_real t, const gains_real *q, const gains_real *v,
               gains_real *tau);

#ifdef __cplusplus
}
#endif

#endif

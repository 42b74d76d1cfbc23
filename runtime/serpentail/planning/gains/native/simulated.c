/* The gains as a controller in a simulated run: ticks are at the starts of the integrator's steps, so
   that a trial state never counts as measured, and torques are held between ticks. */

#include "gains.h"

typedef struct {
    gains_state state;
    gains_real *held;             /* (m) N m */
    const gains_real *step_begin; /* s, the run's time at its step's start */
    gains_real clock;             /* the run's time at which the plan starts */
    long tick;                    /* number of the last tick, from the plan's start; -1: none yet */
} gains_simulation;

int gains_simulated(void *context, gains_real t, const gains_real *q, const gains_real *v,
                    gains_real *tau)
{
    gains_simulation *run = context;
    const gains_real period = run->state.task->period, begun = *run->step_begin - run->clock;
    const gains_real clock = begun < t ? begun : t;
    const long tick = clock < 0 ? 0 : (long)(clock / period + 1e-6);
    if (tick > run->tick) {
        run->tick = tick;
        (void)gains_tick(&run->state, clock, q, v, run->held);
    }
    for (int a = 0; a < run->state.task->tail; a++) {
        tau[a] = run->held[a];
    }
    return 0;
}

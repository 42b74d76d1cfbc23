/* One call of the forward dynamics, Eq. 1.  Build: cc -std=c99 -O2 -Iinclude example/main.c src/golden_loops.c -lm */
#include <stdio.h>

#include "golden_loops.h"

int main(void)
{
  golden_loops_parameters parameters;
  golden_loops_default_parameters(&parameters);
  const golden_loops_real q[GOLDEN_LOOPS_NQ] = { [3] = 1.0, [7] = 0.5 }; /* torso upright, first tail coordinate 0.5 rad */
  const golden_loops_real v[GOLDEN_LOOPS_NV] = { [3] = 1.0 }; /* the torso pitches at 1 rad/s */
  const golden_loops_real tau[GOLDEN_LOOPS_NT] = { 0.0001 }; /* N m, on the first tail coordinate */
  golden_loops_real v_dot[GOLDEN_LOOPS_NV];
  golden_loops_real work[GOLDEN_LOOPS_WORK_FORWARD_DYNAMICS + 1]; /* + 1: C has no arrays of size 0 */
  if (golden_loops_forward_dynamics(&parameters, q, v, tau, v_dot, work) != GOLDEN_LOOPS_OK) {
    return 1;
  }
  for (int k = 0; k < GOLDEN_LOOPS_NV; ++k) {
    printf("v_dot[%d] = %.9g\n", k, (double)v_dot[k]);
  }
  return 0;
}

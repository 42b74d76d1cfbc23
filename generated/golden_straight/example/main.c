/* One call of the forward dynamics, Eq. 1.  Build: cc -std=c99 -O2 -Iinclude example/main.c src/golden_straight.c -lm */
#include <stdio.h>

#include "golden_straight.h"

int main(void)
{
  golden_straight_parameters parameters;
  golden_straight_default_parameters(&parameters);
  const golden_straight_real q[GOLDEN_STRAIGHT_NQ] = { [3] = 1.0, [7] = 0.5 }; /* torso upright, first tail coordinate 0.5 rad */
  const golden_straight_real v[GOLDEN_STRAIGHT_NV] = { [3] = 1.0 }; /* the torso pitches at 1 rad/s */
  const golden_straight_real tau[GOLDEN_STRAIGHT_NT] = { 0.0001 }; /* N m, on the first tail coordinate */
  golden_straight_real v_dot[GOLDEN_STRAIGHT_NV];
  golden_straight_real work[GOLDEN_STRAIGHT_WORK_FORWARD_DYNAMICS + 1]; /* + 1: C has no arrays of size 0 */
  if (golden_straight_forward_dynamics(&parameters, q, v, tau, v_dot, work) != GOLDEN_STRAIGHT_OK) {
    return 1;
  }
  for (int k = 0; k < GOLDEN_STRAIGHT_NV; ++k) {
    printf("v_dot[%d] = %.9g\n", k, (double)v_dot[k]);
  }
  return 0;
}

/* Calls every function of a model on stored states, and prints status, the bits of the outputs, and the cost.
 *
 * cases.h, written for the model, defines: `real`; `states[STATES][INPUTS]`; `cases[CASES]` with name, function and number
 * of outputs, where the first case does nothing and the second only uses a known amount of stack; `prepare`; OUTPUTS and
 * WORK, the largest numbers of reals that a case needs.
 */
#include <string.h>

#include "cases.h"
#include "port.h"

enum { REPEATS = 8, PAINT = 0x5a5aa5a5, MARGIN = 4, DEEPEST = 16384 }; /* in words */

static real outputs[OUTPUTS], work[WORK];

static void write_number(const char *before, uint64_t value, unsigned base)
{
  char text[24], *at = text + sizeof text;
  *--at = '\0';
  do {
    *--at = "0123456789abcdef"[value % base];
    value /= base;
  } while (value > 0);
  port_write(before);
  port_write(at);
}

static void write_bits(real value)
{
  uint64_t bits = 0;
#if REAL_IS_FLOAT
  uint32_t half;
  memcpy(&half, &value, sizeof half);
  bits = half;
#else
  memcpy(&bits, &value, sizeof bits);
#endif
  write_number(" ", bits, 16);
}

/* Instructions of one call, including the loop around it. */
static uint32_t cost(const struct a_case *test, const real *state)
{
  port_start_counting();
  for (int k = 0; k < REPEATS; ++k) {
    test->call(state, outputs, work);
  }
  return port_counted() / REPEATS;
}

/* Paint the stack from here down; return the top of the paint, a few words below the caller's frame. */
static __attribute__((noinline)) volatile uint32_t *paint(void)
{
  volatile uint32_t *const top = (volatile uint32_t *)__builtin_frame_address(0) - MARGIN;
  for (volatile uint32_t *at = top - DEEPEST; at < top; ++at) {
    *at = PAINT;
  }
  return top;
}

/* Bytes of painted stack that one call uses; 0 on a host, whose stack is not painted. */
static __attribute__((noinline)) uint32_t depth(const struct a_case *test, const real *state)
{
  if (port_stack_top - port_stack_low < 2 * DEEPEST) {
    return 0;
  }
  volatile uint32_t *const top = paint(), *lowest = top - DEEPEST;
  test->call(state, outputs, work);
  while (lowest < top && *lowest == PAINT) {
    ++lowest;
  }
  return (uint32_t)((uintptr_t)top - (uintptr_t)lowest);
}

int main(void)
{
  prepare();
  for (int c = 0; c < CASES; ++c) {
    for (int s = 0; s < STATES; ++s) {
      const int status = cases[c].call(states[s], outputs, work);
      port_write(cases[c].name);
      write_number(" ", (uint64_t)s, 10);
      write_number(" ", (uint64_t)status, 10);
      for (int k = 0; k < cases[c].outputs; ++k) {
        write_bits(outputs[k]);
      }
      const uint32_t instructions = cost(&cases[c], states[s]);
      write_number(" | ", instructions, 10);
      write_number(" ", depth(&cases[c], states[s]), 10);
      port_write("\n");
    }
  }
  return 0;
}

/* Calls a model's C on blocks of exactly the size that its header asks for, at the states that stdin has.
 *
 * memory.py puts the model's prefix for the at sign, in capitals for two of them, its functions for //bare and //rows,
 * their lengths for //entries.  A record of stdin is three numbers of type int - which call, how many states, a method -, then
 * the parameters, then the inputs.  What a call may write is left as malloc gives it.  A line of stdout has a call's
 * status and whether all that it wrote is finite.
 */
#include "@_host.c"
#include "@_simulation.h"

#include <stdio.h>
#include <stdlib.h>

enum { MOST_ARRAYS = 10, NQ = @@_NQ, NV = @@_NV, NT = @@_NT, BRISTLES = 2 * @@_CONTACTS, SAMPLES = 4, EVENTS = 16 };

typedef struct {
  int (*bare)(const @_parameters *, real **, real *);
  int (*batch)(@_call *);
  int (*rows)(@_call *);
  int inputs, outputs, work, rows_work;
  int length[MOST_ARRAYS];
} entry;

//rows
//bare
static const entry entries[] = {
//entries
};

enum { FUNCTIONS = sizeof entries / sizeof entries[0] };

static real *block(size_t length)
{
  real *const made = length ? malloc(length * sizeof *made) : NULL;
  if (length && made == NULL) {
    abort();
  }
  return made;
}

static real *given(size_t length)
{
  real *const made = block(length);
  if (length && fread(made, sizeof *made, length, stdin) != length) {
    abort();
  }
  return made;
}

static int finite(const real *x, size_t length)
{
  int bad = 0;
  for (size_t k = 0; k < length; ++k) {
    if (!(x[k] - x[k] == 0)) { /* a branch, which valgrind follows */
      ++bad;
    }
  }
  return bad == 0;
}

static void told(int status, int sound)
{
  printf("%d %d\n", status, sound);
}

static void call(const entry *of, int form, size_t count, const @_parameters *parameters)
{
  @_call it = { parameters, count, 0, block((size_t)(form == 2 ? of->rows_work : of->work)), { NULL } };
  for (int k = 0; k < of->inputs + of->outputs; ++k) {
    const size_t length = count * (size_t)of->length[k];
    it.arrays[k] = k < of->inputs ? given(length) : block(length);
  }
  const int status = form == 0 ? of->bare(parameters, it.arrays, it.work) : (form == 1 ? of->batch : of->rows)(&it);
  int sound = 1;
  for (int k = of->inputs; status == @@_OK && k < of->inputs + of->outputs; ++k) {
    sound &= finite(it.arrays[k], count * (size_t)of->length[k]);
  }
  told(status, sound);
  for (int k = 0; k < of->inputs + of->outputs; ++k) {
    free(it.arrays[k]);
  }
  free(it.work);
}

/* Runs from the states given, with legs that stand still, damping and a reference that is tracked. */
static void rollout(int method, const @_parameters *parameters)
{
  real *const q = given(NQ), *const v = given(NV), *const damping = given(NT), *const times = given(SAMPLES);
  real *const begins = given(1), *const span = given(2), *const feet = given(4), *const angles = given(NT);
  real *const settings = given(5), *const bristles = block(BRISTLES), *const work = block(@@_WORK_ROLLOUT);
  real *const q_out = block(SAMPLES * NQ), *const v_out = block(SAMPLES * NV), *const tau_out = block(SAMPLES * NT);
  real *const bristles_out = block(SAMPLES * BRISTLES), *const event_times = block(EVENTS);
  int *const event_kinds = malloc(EVENTS * sizeof *event_kinds);
  for (int k = 0; k < BRISTLES; ++k) {
    bristles[k] = 0;
  }
  const @_piecewise legs = { 1, 4, 0, span, feet }, reference = { 1, NT, 0, span, angles };
  const @_controller controller = { .damping = damping, .reference = settings[0] > 0 ? &reference : NULL,
    .kp = settings[0], .kd = 2 };
  const @_drive drive = { 1, begins, &controller, 0, NULL, &legs };
  @_run it = { .parameters = parameters, .drive = &drive, .q = q, .v = v, .bristles = bristles, .method = method,
    .rtol = settings[1], .atol = settings[2], .step = settings[3], .least_step = settings[4], .most_step = 1,
    .most_steps = 3000, .pause = 7, .samples = SAMPLES, .times = times, .q_out = q_out, .v_out = v_out,
    .tau_out = tau_out, .work = work, .bristles_out = bristles_out, .most_events = EVENTS,
    .event_times = event_times, .event_kinds = event_kinds };
  int status = @@_PAUSED;
  while (status == @@_PAUSED) {
    status = @_rollout(&it);
  }
  const size_t done = (size_t)it.done;
  told(status, finite(q_out, done * NQ) & finite(v_out, done * NV) & finite(tau_out, done * NT)
    & finite(bristles_out, done * BRISTLES) & finite(event_times, (size_t)(it.events < EVENTS ? it.events : EVENTS)));
  real *const all[] = { q, v, damping, times, begins, span, feet, angles, settings, bristles, work, q_out, v_out,
    tau_out, bristles_out, event_times };
  for (size_t k = 0; k < sizeof all / sizeof all[0]; ++k) {
    free(all[k]);
  }
  free(event_kinds);
}

int main(void)
{
  int record[3];
  while (fread(record, sizeof record, 1, stdin) == 1) {
    @_parameters *const parameters = malloc(sizeof *parameters);
    if (parameters == NULL || fread(parameters, sizeof *parameters, 1, stdin) != 1) {
      abort();
    }
    if (record[0] < 3 * FUNCTIONS) {
      call(&entries[record[0] / 3], record[0] % 3, (size_t)record[1], parameters);
    } else {
      rollout(record[2], parameters);
    }
    free(parameters);
  }
  return 0;
}

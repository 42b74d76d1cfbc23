/* Takes closures with the signature of a forward dynamics and a set of states; gives the minimum and the
   median nanoseconds of one call of each, over interleaved rounds in one process. */
#include <stdlib.h>
#include <time.h>

typedef int (*forward_dynamics)(void *context, const double *q, const double *v, const double *tau,
                                double *v_dot);

struct closure {
    forward_dynamics function;
    void *context;
};

/* `count` states, one after the other in each of the three arrays */
struct states {
    size_t count, nq, nv, n_tau;
    const double *q, *v, *tau;
};

/* Every result goes through here, so that no call can be left out. */
static volatile double checksum;

static double now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static int failed_calls(const struct closure *closure, const struct states *x, int calls, double *v_dot)
{
    int failures = 0;
    double sum = 0.0;
    size_t k = 0;
    for (int call = 0; call < calls; ++call) {
        failures += closure->function(closure->context, x->q + k * x->nq, x->v + k * x->nv,
                                      x->tau + k * x->n_tau, v_dot) != 0;
        sum += v_dot[0] + v_dot[x->nv - 1];
        k = k + 1 == x->count ? 0 : k + 1;
    }
    checksum += sum;
    return failures;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Rounds go A B C, A B C, ... after one round that is not timed.  Returns the number of calls that reported a
   failure, or -1 where memory ran out. */
int time_rounds(int competitors, const struct closure *closures, const struct states *states, int rounds,
                int calls, double *min_ns, double *median_ns)
{
    double *times = malloc((size_t)competitors * (size_t)rounds * sizeof *times);
    double *v_dot = calloc(states->nv, sizeof *v_dot);
    int failures = times && v_dot ? 0 : -1;

    for (int round = -1; failures == 0 && round < rounds; ++round)
        for (int c = 0; c < competitors; ++c) {
            const double start = now_ns();
            failures += failed_calls(&closures[c], states, calls, v_dot);
            const double elapsed = now_ns() - start;
            if (round >= 0)
                times[c * rounds + round] = elapsed / calls;
        }
    for (int c = 0; failures == 0 && c < competitors; ++c) {
        double *mine = times + c * rounds;
        qsort(mine, (size_t)rounds, sizeof *mine, ascending);
        min_ns[c] = mine[0];
        median_ns[c] = 0.5 * (mine[(rounds - 1) / 2] + mine[rounds / 2]);
    }
    free(times);
    free(v_dot);
    return failures;
}

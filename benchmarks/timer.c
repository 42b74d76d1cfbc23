/* Times closures on a set of states: the least nanoseconds of one call of each, over interleaved rounds. */
#include <stdlib.h>
#include <time.h>

typedef int (*measured)(void *context, const double *q, const double *v, const double *rest, double *out);

struct closure {
    measured function;
    void *context;
};

/* `count` states, one after the other in each of the three arrays */
struct states {
    size_t count, nq, nv, n_rest;
    const double *q, *v, *rest;
};

/* Every result goes through here, so that no call can be left out. */
static volatile double checksum;

static double now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static int failed_calls(const struct closure *closure, const struct states *x, int calls, double *out)
{
    int failures = 0;
    double sum = 0.0;
    size_t k = 0;
    for (int call = 0; call < calls; ++call) {
        failures += closure->function(closure->context, x->q + k * x->nq, x->v + k * x->nv,
                                      x->rest + k * x->n_rest, out) != 0;
        sum += out[0] + out[x->nv - 1];
        k = k + 1 == x->count ? 0 : k + 1;
    }
    checksum += sum;
    return failures;
}

/* Rounds go A B C, A B C, ... after one round that is not timed.  Returns the number of calls that failed. */
int time_rounds(int competitors, const struct closure *closures, const struct states *states, int rounds,
                int calls, double *least_ns)
{
    double *out = calloc(states->nv, sizeof *out);
    int failures = 0;
    for (int round = -1; failures == 0 && round < rounds; ++round)
        for (int c = 0; c < competitors; ++c) {
            const double start = now_ns();
            failures += failed_calls(&closures[c], states, calls, out);
            const double ns = (now_ns() - start) / calls;
            if (round < 1 || ns < least_ns[c]) /* the first timed round begins anew */
                least_ns[c] = ns;
        }
    free(out);
    return failures;
}

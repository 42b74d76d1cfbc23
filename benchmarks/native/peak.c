/* Multiply-adds as fast as this core does them: independent chains of the widest vectors.

   Few chains leave the units waiting for their own results, many do not fit the registers, 16 of AVX2 and 32 of
   AVX-512: the caller tries several. */
#include <stddef.h>
#include <time.h>

#if defined(__AVX512F__)
enum { LANES = 8 };
#elif defined(__AVX__)
enum { LANES = 4 };
#else
enum { LANES = 2 };
#endif
typedef double lanes __attribute__((vector_size(LANES * sizeof(double))));
enum { STEPS = 2000, ROUNDS = 2000, MOST = 24 };

static volatile double kept;

static double now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

/* Inlined, so that a number of chains is a constant and every chain a register. */
static inline __attribute__((always_inline)) double round_ns(const int chains)
{
    lanes x[MOST];
    for (int k = 0; k < chains; ++k)
        for (int l = 0; l < LANES; ++l)
            x[k][l] = k + l;
    const double begun = now_ns();
    for (int step = 0; step < STEPS; ++step)
#pragma GCC unroll 24
        for (int k = 0; k < chains; ++k)
            x[k] = x[k] * 0.999 + 0.001;
    const double spent = now_ns() - begun;
    for (int k = 0; k < chains; ++k)
        kept = x[k][0];
    return spent;
}

static double timed(int chains)
{
    switch (chains) {
    case 8: return round_ns(8);
    case 10: return round_ns(10);
    case 12: return round_ns(12);
    case 16: return round_ns(16);
    case 24: return round_ns(24);
    default: return 0.0;
    }
}

/* flops per nanosecond with so many chains, the best of some rounds; 0 for a number that is not among those
   above; *width: how many doubles a vector holds */
double measure_peak(int chains, int *width);
double measure_peak(int chains, int *width)
{
    double best = 0.0;
    *width = LANES;
    for (int round = 0; round < ROUNDS; ++round) {
        const double spent = timed(chains), rate = spent > 0.0 ? 2.0 * LANES * chains * STEPS / spent : 0.0;
        best = rate > best ? rate : best;
    }
    return best;
}

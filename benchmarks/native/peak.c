/* Multiply-adds as fast as this core does them: independent chains of the widest vectors. */
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
enum { CHAINS = 16, STEPS = 2000 };

static volatile double kept;

static double now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

/* flops per nanosecond, the best of some rounds; *width: how many doubles a vector holds */
double measure_peak(int *width);
double measure_peak(int *width)
{
    double best = 0.0;
    *width = LANES;
    for (int round = 0; round < 5000; ++round) {
        lanes x[CHAINS];
        for (int k = 0; k < CHAINS; ++k)
            for (int l = 0; l < LANES; ++l)
                x[k][l] = k + l;
        const double begun = now_ns();
        for (int step = 0; step < STEPS; ++step)
#pragma GCC unroll 16
            for (int k = 0; k < CHAINS; ++k)
                x[k] = x[k] * 0.999 + 0.001;
        const double rate = 2.0 * LANES * CHAINS * STEPS / (now_ns() - begun);
        best = rate > best ? rate : best;
        for (int k = 0; k < CHAINS; ++k)
            kept = x[k][0];
    }
    return best;
}

/* Multiply-adds as fast as this core does them: independent chains of scalars, and of the widest vectors. */
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

/* flops per nanosecond of scalars, then of vectors; the best of some rounds */
void measure_peak(double *scalar, double *vector);
void measure_peak(double *scalar, double *vector)
{
    *scalar = *vector = 0.0;
    for (int round = 0; round < 5000; ++round) {
        double x[CHAINS];
        lanes y[CHAINS];
        for (int k = 0; k < CHAINS; ++k) {
            x[k] = k;
            for (int l = 0; l < LANES; ++l)
                y[k][l] = k + l;
        }
        double begun = now_ns();
        for (int step = 0; step < STEPS; ++step)
#pragma GCC unroll 16
            for (int k = 0; k < CHAINS; ++k) {
                x[k] = x[k] * 0.999 + 0.001;
                __asm__ volatile("" : "+x"(x[k])); /* one by one: no vector of chains */
            }
        double rate = 2.0 * CHAINS * STEPS / (now_ns() - begun);
        *scalar = rate > *scalar ? rate : *scalar;
        begun = now_ns();
        for (int step = 0; step < STEPS; ++step)
#pragma GCC unroll 16
            for (int k = 0; k < CHAINS; ++k)
                y[k] = y[k] * 0.999 + 0.001;
        rate = 2.0 * LANES * CHAINS * STEPS / (now_ns() - begun);
        *vector = rate > *vector ? rate : *vector;
        for (int k = 0; k < CHAINS; ++k)
            kept = x[k] + y[k][0];
    }
}

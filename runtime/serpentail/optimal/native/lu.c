/* Linear equations of a few dozen unknowns, row by row, so that inner loops run along rows. */

#include <math.h>

#include "stage.h"

static void swap_rows(double *a, double *b, int columns)
{
    for (int j = 0; j < columns; j++) {
        double kept = a[j];
        a[j] = b[j];
        b[j] = kept;
    }
}

/* b -= sum of factors times the rows of A, four at a time: each pass over b is one over memory. */
void subtract_rows(int count, const double *factors, const double *A, int stride, double *b,
                   int columns)
{
    int k = 0;
    for (; k + 4 <= count; k += 4) {
        const double f0 = factors[k], f1 = factors[k + 1], f2 = factors[k + 2],
                     f3 = factors[k + 3];
        const double *r0 = A + (size_t)k * stride, *r1 = r0 + stride, *r2 = r1 + stride,
                     *r3 = r2 + stride;
        for (int j = 0; j < columns; j++) {
            b[j] -= f0 * r0[j] + f1 * r1[j] + f2 * r2[j] + f3 * r3[j];
        }
    }
    for (; k < count; k++) {
        const double f = factors[k], *row = A + (size_t)k * stride;
        for (int j = 0; j < columns; j++) {
            b[j] -= f * row[j];
        }
    }
}

static int pivot_of(int n, const double *A, int k)
{
    int best = k;
    for (int i = k + 1; i < n; i++) {
        if (fabs(A[(size_t)i * n + k]) > fabs(A[(size_t)best * n + k])) {
            best = i;
        }
    }
    return best;
}

/* L U = P A in place, pivots as LAPACK has them, from 0. */
int factorise(int n, double *A, int *pivots)
{
    for (int k = 0; k < n; k++) {
        double *row = A + (size_t)k * n;
        int p = pivot_of(n, A, k);
        pivots[k] = p;
        if (!(fabs(A[(size_t)p * n + k]) > 0.0)) { /* nan, too */
            return 1;
        }
        if (p != k) {
            swap_rows(row, A + (size_t)p * n, n);
        }
        for (int i = k + 1; i < n; i++) {
            double *other = A + (size_t)i * n;
            const double f = other[k] / row[k];
            other[k] = f;
            if (f != 0.0) {
                for (int j = k + 1; j < n; j++) {
                    other[j] -= f * row[j];
                }
            }
        }
    }
    return 0;
}

/* B (n, columns) becomes A^-1 B. */
void solve(int n, const double *A, const int *pivots, int columns, double *B)
{
    for (int k = 0; k < n; k++) {
        if (pivots[k] != k) {
            swap_rows(B + (size_t)k * columns, B + (size_t)pivots[k] * columns, columns);
        }
    }
    for (int i = 1; i < n; i++) {
        subtract_rows(i, A + (size_t)i * n, B, columns, B + (size_t)i * columns, columns);
    }
    for (int i = n - 1; i >= 0; i--) {
        const double *row = A + (size_t)i * n;
        double *b = B + (size_t)i * columns;
        subtract_rows(n - 1 - i, row + i + 1, b + columns, columns, b, columns);
        for (int j = 0; j < columns; j++) {
            b[j] /= row[i];
        }
    }
}

/* b (n) becomes A^-T b. */
void solve_transposed(int n, const double *A, const int *pivots, double *b)
{
    for (int i = 0; i < n; i++) {
        const double *row = A + (size_t)i * n;
        b[i] /= row[i];
        for (int j = i + 1; j < n; j++) {
            b[j] -= b[i] * row[j];
        }
    }
    for (int i = n - 1; i > 0; i--) {
        const double *row = A + (size_t)i * n;
        for (int j = 0; j < i; j++) {
            b[j] -= b[i] * row[j];
        }
    }
    for (int k = n - 1; k >= 0; k--) {
        double kept = b[k];
        b[k] = b[pivots[k]];
        b[pivots[k]] = kept;
    }
}

int is_moderate(const double *values, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        if (!(fabs(values[k]) < LARGEST)) { /* nan, too */
            return 0;
        }
    }
    return 1;
}

/* Solves strictly convex quadratic programs with a lower and an upper bound of each variable. */

#include <math.h>

#include "mpc.h"

enum { FREE, LOWER, UPPER };
static const double TIGHT = 1e-12; /* allowed error of a multiplier, relative to slopes */

/* Factorise the rows and columns of H of the free variables as L D L^T, stored in F (count, count);
   return 0 if D > 0. */
static int factorise(int n, const double *H, const int *set, double *F, int *count)
{
    int rows = 0;
    for (int i = 0; i < n; i++) {
        if (set[i] == FREE) {
            int column = 0;
            for (int j = 0; j <= i; j++) {
                if (set[j] == FREE) {
                    F[(size_t)rows * (size_t)n + (size_t)column++] =
                        H[(size_t)i * (size_t)n + (size_t)j];
                }
            }
            rows++;
        }
    }
    *count = rows;
    for (int i = 0; i < rows; i++) {
        double *own = F + (size_t)i * (size_t)n;
        for (int j = 0; j < i; j++) { /* own[j] becomes L[i][j] D[j] */
            const double *other = F + (size_t)j * (size_t)n;
            for (int k = 0; k < j; k++) {
                own[j] -= own[k] * other[k];
            }
        }
        double pivot = own[i];
        for (int j = 0; j < i; j++) {
            const double scaled = own[j] / F[(size_t)j * (size_t)n + (size_t)j];
            pivot -= own[j] * scaled;
            own[j] = scaled;
        }
        if (!(pivot > 0.0)) { /* or nan */
            return 1;
        }
        own[i] = pivot;
    }
    return 0;
}

/* Replace b (count) by (L D L^T)^-1 b. */
static void solve(int n, int count, const double *F, double *b)
{
    for (int i = 0; i < count; i++) {
        for (int j = 0; j < i; j++) {
            b[i] -= F[(size_t)i * (size_t)n + (size_t)j] * b[j];
        }
    }
    for (int i = count - 1; i >= 0; i--) {
        b[i] /= F[(size_t)i * (size_t)n + (size_t)i];
        for (int j = i + 1; j < count; j++) {
            b[i] -= F[(size_t)j * (size_t)n + (size_t)i] * b[j];
        }
    }
}

/* slope = H d + g; return the largest sum of the magnitudes of an entry's terms. */
static double write_slope(int n, const double *H, const double *g, const double *d, double *slope)
{
    double largest = 0.0;
    for (int i = 0; i < n; i++) {
        double size = fabs(g[i]);
        slope[i] = g[i];
        for (int j = 0; j < n; j++) {
            const double term = H[(size_t)i * (size_t)n + (size_t)j] * d[j];
            slope[i] += term;
            size += fabs(term);
        }
        largest = size > largest ? size : largest;
    }
    return largest;
}

/* Move d by p to the minimum of the free variables, or as far as bounds allow.  The bound that
   stops the move joins the set; return whether there is one. */
static int advance(int n, const double *p, const double *lower, const double *upper, double *d,
                   int *set)
{
    double part = 1.0;
    int stopped = -1, side = FREE;
    for (int i = 0; i < n; i++) {
        if (set[i] == FREE && p[i] < 0.0 && d[i] + part * p[i] < lower[i]) {
            part = (lower[i] - d[i]) / p[i];
            stopped = i;
            side = LOWER;
        } else if (set[i] == FREE && p[i] > 0.0 && d[i] + part * p[i] > upper[i]) {
            part = (upper[i] - d[i]) / p[i];
            stopped = i;
            side = UPPER;
        }
    }
    for (int i = 0; i < n; i++) {
        if (set[i] == FREE) {
            d[i] += part * p[i];
        }
    }
    if (stopped >= 0) {
        set[stopped] = side;
        d[stopped] = side == LOWER ? lower[stopped] : upper[stopped];
    }
    return stopped >= 0;
}

/* Free the variable that its bound holds back most; return whether there is one. */
static int release(int n, const double *slope, double least, int *set)
{
    int worst = -1;
    for (int i = 0; i < n; i++) {
        const double wrong = set[i] == LOWER ? -slope[i] : set[i] == UPPER ? slope[i] : 0.0;
        if (wrong > least) {
            least = wrong;
            worst = i;
        }
    }
    if (worst >= 0) {
        set[worst] = FREE;
    }
    return worst >= 0;
}

int mpc_quadratic(int n, const double *H, const double *g, const double *lower,
                  const double *upper, double *d, int *set, double *memory)
{
    double *F = memory, *slope = F + (size_t)n * (size_t)n, *p = slope + n, *b = p + n;
    for (int i = 0; i < n; i++) {
        d[i] = 0.0;
        set[i] = !(lower[i] < 0.0) && g[i] > 0.0 ? LOWER
               : !(upper[i] > 0.0) && g[i] < 0.0 ? UPPER
                                                 : FREE;
    }
    for (int changes = 0; changes <= 10 * n + 10; changes++) {
        int count, free = 0;
        const double size = write_slope(n, H, g, d, slope);
        if (!isfinite(size) || factorise(n, H, set, F, &count) != 0) {
            return -1;
        }
        for (int i = 0; i < n; i++) {
            if (set[i] == FREE) {
                b[free++] = -slope[i];
            }
        }
        solve(n, count, F, b);
        free = 0;
        for (int i = 0; i < n; i++) {
            p[i] = set[i] == FREE ? b[free++] : 0.0;
        }
        if (advance(n, p, lower, upper, d, set)) {
            continue;
        }
        const double least = TIGHT * write_slope(n, H, g, d, slope);
        if (!release(n, slope, least, set)) {
            return changes;
        }
    }
    return -1;
}

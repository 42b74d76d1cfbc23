/* Solves strictly convex quadratic programs with bounds of variables and of rows, by the dual method
   of Goldfarb and Idnani (Math. Programming 27, 1983): from the minimum without bounds, it adds the
   bound that is exceeded most, until none is. */

#include <float.h>
#include <math.h>
#include <string.h>

#include "mpc_layout.h"

static const double TIGHT = 1e-11 + 128 * DBL_EPSILON;    /* of a bound's range: allowed excess */
static const double DEPENDENT = 1e-13 + 16 * DBL_EPSILON; /* of a normal's square: no direction left */

/* Workspace.  J J^T is the inverse of R^T R; J^T N = (R; 0) for the normals N of the active bounds. */
typedef struct {
    int active;
    double *J, *R;           /* (n, n) */
    double *turned, *z, *r;  /* (n): J^T normal; step of d and of the multipliers */
    double *multiplier;      /* (n) */
    int *which, *side;       /* (n): active bounds; +1 for a lower, -1 for an upper one */
    int *closed;             /* (n + rows): 1 if active or given up */
} dual;

/* Compute J = R^-1, by columns from the diagonal up; return 0 if that exists. */
static int invert(int n, const double *R, double *J)
{
    for (int c = 0; c < n; c++) {
        for (int i = n - 1; i >= 0; i--) {
            double sum = i == c ? 1.0 : 0.0;
            for (int k = i + 1; k <= c; k++) {
                sum -= R[i * n + k] * J[k * n + c];
            }
            J[i * n + c] = i > c ? 0.0 : sum / R[i * n + i];
            if (!isfinite(J[i * n + c])) {
                return 1;
            }
        }
    }
    return 0;
}

/* The value of row i of (identity; A) times d. */
static double value_of(const mpc_bounded *qp, int i)
{
    if (i < qp->n) {
        return qp->d[i];
    }
    const double *row = qp->A + (i - qp->n) * qp->n;
    double sum = 0.0;
    for (int k = 0; k < qp->n; k++) {
        sum += row[k] * qp->d[k];
    }
    return sum;
}

/* Find the bound that is exceeded most, relative to its range; return -1 if none is. */
static int most_exceeded(const mpc_bounded *qp, const dual *w, int *side, double *excess)
{
    double worst = TIGHT;
    int found = -1;
    for (int i = 0; i < qp->n + qp->rows; i++) {
        if (w->closed[i]) {
            continue;
        }
        const double value = value_of(qp, i), range = qp->upper[i] - qp->lower[i];
        const double low = qp->lower[i] - value, high = value - qp->upper[i];
        const double over = low > high ? low : high;
        if (over > worst * range) {
            worst = range > 0.0 ? over / range : NONE;
            *excess = over;
            *side = low > high ? 1 : -1;
            found = i;
        }
    }
    return found;
}

/* Compute the steps of d (z) and of the multipliers (-r) for one more of bound p; return the part of
   its normal's square, in the metric of J J^T, that the active bounds leave. */
static double write_steps(const mpc_bounded *qp, dual *w, int p, int side)
{
    const int n = qp->n, q = w->active;
    double left = 0.0, all = 0.0;
    for (int c = 0; c < n; c++) {
        double sum = 0.0;
        if (p < n) {
            sum = w->J[p * n + c];
        } else {
            const double *row = qp->A + (p - n) * n;
            for (int k = 0; k < n; k++) {
                sum += row[k] * w->J[k * n + c];
            }
        }
        w->turned[c] = side > 0 ? sum : -sum;
        all += sum * sum;
        left += c < q ? 0.0 : sum * sum;
    }
    for (int i = 0; i < n; i++) {
        double sum = 0.0;
        for (int c = q; c < n; c++) {
            sum += w->J[i * n + c] * w->turned[c];
        }
        w->z[i] = sum;
    }
    for (int i = q - 1; i >= 0; i--) {
        double sum = w->turned[i];
        for (int k = i + 1; k < q; k++) {
            sum -= w->R[i * n + k] * w->r[k];
        }
        w->r[i] = sum / w->R[i * n + i];
    }
    return left > DEPENDENT * all ? left : 0.0;
}

double mpc_rotation(double a, double b, double *cosine, double *sine)
{
    const double norm = sqrt(a * a + b * b);
    *cosine = norm > 0.0 ? a / norm : 1.0;
    *sine = norm > 0.0 ? b / norm : 0.0;
    return norm;
}

/* Rotate columns k and k + 1 of J. */
static void rotate(int n, double *J, int k, double cosine, double sine)
{
    for (int i = 0; i < n; i++) {
        double *pair = J + i * n + k;
        const double first = pair[0], second = pair[1];
        pair[0] = cosine * first + sine * second;
        pair[1] = cosine * second - sine * first;
    }
}

static void join(const mpc_bounded *qp, dual *w, int p, int side, double multiplier)
{
    const int n = qp->n, q = w->active++;
    double cosine, sine;
    for (int k = n - 2; k >= q; k--) {
        w->turned[k] = mpc_rotation(w->turned[k], w->turned[k + 1], &cosine, &sine);
        rotate(n, w->J, k, cosine, sine);
    }
    for (int i = 0; i <= q; i++) {
        w->R[i * n + q] = w->turned[i];
    }
    w->which[q] = p;
    w->side[q] = side;
    w->multiplier[q] = multiplier;
    w->closed[p] = 1;
}

static void leave(const mpc_bounded *qp, dual *w, int out)
{
    const int n = qp->n, q = --w->active;
    double cosine, sine;
    for (int k = out; k < q; k++) {
        w->which[k] = w->which[k + 1];
        w->side[k] = w->side[k + 1];
        w->multiplier[k] = w->multiplier[k + 1];
        for (int i = 0; i <= k + 1; i++) {
            w->R[i * n + k] = w->R[i * n + k + 1];
        }
    }
    for (int k = out; k < q; k++) { /* the columns moved, and have one entry below the diagonal */
        double *upper = w->R + k * n, *lower = upper + n;
        upper[k] = mpc_rotation(upper[k], lower[k], &cosine, &sine);
        for (int c = k + 1; c < q; c++) {
            const double first = upper[c], second = lower[c];
            upper[c] = cosine * first + sine * second;
            lower[c] = cosine * second - sine * first;
        }
        rotate(n, w->J, k, cosine, sine);
    }
}

/* Raise the multiplier of bound p until it is active, or given up because that costs too much.  On
   the way others become inactive, or are given up: what these cost stays in the sum.  Return the
   number of changes, at most most + 1. */
static int enforce(mpc_bounded *qp, dual *w, int p, int side, double excess, int most)
{
    double own = 0.0;
    for (int changes = 1; changes <= most; changes++) {
        const double left = write_steps(qp, w, p, side);
        double step = p < qp->n ? NONE : qp->price - own;
        int out = -1, joins = 0, dear = 0;
        if (left > 0.0 && excess / left < step) {
            step = excess / left;
            joins = 1;
        }
        for (int k = 0; k < w->active; k++) {
            if (w->r[k] > 0.0 && w->multiplier[k] < step * w->r[k]) {
                step = w->multiplier[k] / w->r[k];
                out = k;
                dear = 0;
            } else if (w->r[k] < 0.0 && w->which[k] >= qp->n
                       && qp->price - w->multiplier[k] < -step * w->r[k]) {
                step = (qp->price - w->multiplier[k]) / -w->r[k];
                out = k;
                dear = 1;
            }
        }
        if (!(step < NONE)) {
            w->closed[p] = 1;
            return changes;
        }
        for (int i = 0; left > 0.0 && i < qp->n; i++) {
            qp->d[i] += step * w->z[i];
        }
        for (int k = 0; k < w->active; k++) {
            w->multiplier[k] -= step * w->r[k];
        }
        own += step;
        excess -= step * left;
        if (out >= 0) {
            const int row = w->which[out];
            leave(qp, w, out);
            w->closed[row] = dear;
            qp->paid = dear ? qp->price : qp->paid;
        } else {
            if (joins) {
                join(qp, w, p, side, own);
            } else {
                w->closed[p] = 1;
                qp->paid = own;
            }
            return changes;
        }
    }
    return most + 1;
}

int mpc_quadratic(mpc_bounded *qp)
{
    const int n = qp->n, all = n + qp->rows, most = qp->most;
    double *m = qp->memory;
    dual w = {0,
              m,
              m + n * n,
              m + 2 * n * n,
              m + 2 * n * n + n,
              m + 2 * n * n + 2 * n,
              m + 2 * n * n + 3 * n,
              qp->set,
              qp->set + n,
              qp->set + 2 * n};
    int changes = 0, side = 1, p;
    double excess = 0.0;
    memset(w.closed, 0, (size_t)all * sizeof(int));
    qp->paid = 0.0;
    if (invert(n, qp->R, w.J) != 0) {
        return -1;
    }
    for (int i = 0; i < n; i++) { /* the minimum without bounds */
        qp->d[i] = 0.0;
        for (int k = i; k < n; k++) {
            qp->d[i] -= w.J[i * n + k] * qp->c[k];
        }
        if (!isfinite(qp->d[i])) {
            return -1;
        }
    }
    while (changes < most && (p = most_exceeded(qp, &w, &side, &excess)) >= 0) {
        changes += enforce(qp, &w, p, side, excess, most - changes);
    }
    for (int k = 0; k < w.active; k++) {
        if (w.which[k] >= n && w.multiplier[k] > qp->paid) {
            qp->paid = w.multiplier[k];
        }
    }
    return changes < most ? changes : most;
}

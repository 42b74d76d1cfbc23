/* From derivatives by velocities to those by CasADi's inputs: the formulas of docs/casadi.md.

   The C of a model has them for one state at a time, see casadi_external of the generator. */

#ifndef SERPENTAIL_ALGEBRA_H
#define SERPENTAIL_ALGEBRA_H

#include <string.h>

#include "nodes.h"

/* T (3, 4): a small rotation of the torso in body axes is T d(quaternion). */
static void rotation(const double *q, double T[3][4])
{
    const double w = q[3], x = q[4], y = q[5], z = q[6];
    const double s = 2.0 / (w * w + x * x + y * y + z * z);
    const double rows[3][4] = {{-x, w, z, -y}, {-y, -z, w, x}, {-z, y, -x, w}};
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 4; c++) {
            T[r][c] = s * rows[r][c];
        }
    }
}

/* A (rows, nv), derivatives by velocities, become those by q, B (rows, nq). */
static void by_quaternion(const Nodes *nodes, const double *q, size_t rows, const double *A,
                          double *B)
{
    double T[3][4];
    rotation(q, T);
    for (size_t r = 0; r < rows; r++, A += nodes->nv, B += nodes->nq) {
        memcpy(B, A, 3 * sizeof *B);
        for (int c = 0; c < 4; c++) {
            B[3 + c] = A[3] * T[0][c] + A[4] * T[1][c] + A[5] * T[2][c];
        }
        memcpy(B + 7, A + 6, (nodes->nv - 6) * sizeof *B);
    }
}

/* The same for rows: A (nv, columns) becomes B (nq, columns). */
static void quaternion_rows(const Nodes *nodes, const double *q, size_t columns, const double *A,
                            double *B)
{
    const double *turn = A + 3 * columns;
    double T[3][4];
    rotation(q, T);
    memcpy(B, A, 3 * columns * sizeof *B);
    for (int r = 0; r < 4; r++) {
        for (size_t c = 0; c < columns; c++) {
            B[(3 + r) * columns + c] = T[0][r] * turn[c] + T[1][r] * turn[columns + c]
                                     + T[2][r] * turn[2 * columns + c];
        }
    }
    memcpy(B + 7 * columns, A + 6 * columns, (nodes->nv - 6) * columns * sizeof *B);
}

/* x = A^T weights. */
static void weighted_rows(size_t rows, size_t columns, const double *A, const double *weights,
                          double *x)
{
    memset(x, 0, columns * sizeof *x);
    for (size_t r = 0; r < rows; r++, A += columns) {
        for (size_t c = 0; c < columns; c++) {
            x[c] += weights[r] * A[c];
        }
    }
}

/* Along the quaternion, the gradient falls as 1 / |quaternion|. */
static void add_curvature(size_t nq, const double *q, const double *gradient, double *by_qq)
{
    const double square = q[3] * q[3] + q[4] * q[4] + q[5] * q[5] + q[6] * q[6];
    for (size_t r = 3; r < 7; r++) {
        for (size_t c = 3; c < 7; c++) {
            by_qq[r * nq + c] -= (q[r] * gradient[c] + gradient[r] * q[c]) / square;
        }
    }
}

/* Solve H x = b by H = L D L^T; H becomes L, with 1 / D on its diagonal. */
static void solve(size_t n, double *H, const double *b, double *x)
{
    for (size_t k = 0; k < n; k++) {
        double *row = H + k * n;
        x[k] = b[k];
        for (size_t i = 0; i < k; i++) {
            for (size_t j = 0; j < i; j++) {
                row[i] -= row[j] * H[i * n + j];
            }
        }
        for (size_t j = 0; j < k; j++) {
            const double column = row[j];
            row[j] *= H[j * n + j];
            row[k] -= column * row[j];
            x[k] -= row[j] * x[j];
        }
        row[k] = 1.0 / row[k];
    }
    for (size_t k = n; k-- > 0;) {
        x[k] *= H[k * n + k];
        for (size_t j = k + 1; j < n; j++) {
            x[k] -= H[j * n + k] * x[j];
        }
    }
}

/* Second derivatives of weights^T v_dot, of those of mu^T (H v_dot + C): -(W + M^T J + J^T M).
   parts: dq, dv, dtau (J), qq, qv, vv (W, then the results), aq (M), and tq (a result). */
static void eliminate(const Nodes *nodes, double *const *parts)
{
    const size_t nv = nodes->nv, nt = nodes->last;
    const double *dq = parts[0], *dv = parts[1], *dtau = parts[2], *aq = parts[6];
    double *qq = parts[3], *qv = parts[4], *vv = parts[5], *tq = parts[7];
    memset(tq, 0, nt * nv * sizeof *tq);
    for (size_t k = 0; k < nv; k++, dq += nv, dv += nv, aq += nv, dtau += nt) {
        for (size_t i = 3; i < nv; i++) { /* neither depends on the position of B */
            const double a = aq[i], d = dq[i];
            for (size_t j = 3; j < nv; j++) {
                qq[i * nv + j] += a * dq[j] + d * aq[j];
                qv[i * nv + j] += a * dv[j];
            }
        }
        for (size_t i = 0; i < nt; i++) {
            for (size_t j = 3; j < nv; j++) {
                tq[i * nv + j] -= dtau[i] * aq[j];
            }
        }
    }
    for (size_t k = 0; k < nv * nv; k++) {
        qq[k] = -qq[k];
        qv[k] = -qv[k];
        vv[k] = -vv[k];
    }
}

#endif

/* The Hessian of a stage's results: with the adjoint eta of the collocation equations F = 0, it is
   that of mu^T r + eta^T F along dz / dv, by the implicit function theorem. */

#include <string.h>

#include "stage_layout.h"

/* Scratch of a Hessian, after what a node needs. */
typedef struct {
    double *torques, *node, *eta, *mu, *H, *W, *g, *slope, *curvature, *column, *start;
} Work;

static Work work_of(const Stage *stage)
{
    const Task *task = stage->task;
    const size_t zeta = (size_t)size_of_zeta(task), m = (size_t)task->tail;
    Work work;
    work.torques = stage->scratch;
    work.node = work.torques + m;
    work.eta = work.node + node_scratch(task);
    work.mu = work.eta + unknowns_of(task);
    work.H = work.mu + size_of_y(task);
    work.W = work.H + zeta * zeta;
    work.slope = work.W + zeta * (size_t)stage->variables;
    work.curvature = work.slope + 2 * m;
    work.g = work.curvature + 3 * m;
    work.column = work.g + zeta;
    work.start = work.column + stage->variables;
    return work;
}

/* The part of mu that belongs to the inner node's bounded states; NULL at the last node. */
static const double *mu_of_node(const Stage *stage, const double *mu, int node)
{
    const int last = stage->pieces * stage->task->nodes - 1;
    return node == last ? NULL
                        : mu + states_of(stage->task) + (size_t)node * stage->bounded;
}

/* eta of interval p: G^T eta = - the slope by z of all that comes after.  start: what the next
   interval's equations add at this one's end; becomes what this one's add. */
static void adjoint(Stage *stage, const double *mu, int p, Work work)
{
    const Task *task = stage->task;
    const int m = task->tail, K = task->nodes, states = states_of(task);
    const double h = stage->v[stage->variables - 1] * width_of(stage, p);
    const double price = mu[stage->results - 1];
    double *eta = work.eta;
    memset(eta, 0, (size_t)unknowns_of(task) * sizeof *eta);
    for (int i = 0; i < K; i++) {
        const int node = p * K + i;
        const double *x = stage->z + (size_t)node * states;
        const double *bounds = mu_of_node(stage, mu, node);
        double *own = eta + (size_t)i * states;
        torques_at(stage, stage->v, p, i, work.torques);
        cost_of(task, work.torques, x + ATTITUDE + m, work.slope, NULL);
        for (int a = 0; a < m; a++) {
            own[ATTITUDE + m + a] -= price * h * task->weights[i] * work.slope[m + a];
        }
        for (int b = 0; bounds != NULL && b < stage->bounded; b++) {
            own[stage->first_bounded + b] -= bounds[b];
        }
    }
    for (int a = 0; a < states; a++) {
        eta[(size_t)(K - 1) * states + a] -= work.start[a];
    }
    solve_transposed(unknowns_of(task), factors_of(stage, p), pivots_of(stage, p), eta);
    for (int a = 0; a < states; a++) {
        work.start[a] = 0.0;
        for (int i = 0; i < K; i++) {
            work.start[a] += task->states[(size_t)i * (K + 1)] * eta[(size_t)i * states + a];
        }
    }
}

/* Second derivatives by zeta of what a node adds, in H, and its slope by zeta over h, in g. */
static int at_node(Stage *stage, double price, int p, int i, Work work)
{
    const Task *task = stage->task;
    const int m = task->tail, states = states_of(task), zeta = size_of_zeta(task);
    const int rates = ATTITUDE + m;
    const double h = stage->v[stage->variables - 1] * width_of(stage, p);
    const double *eta = work.eta + (size_t)i * states, *J = J_of(stage, p, i);
    const double *x = stage->z + ((size_t)p * task->nodes + i) * states;
    const double weight = price * task->weights[i];
    memset(work.mu, 0, (size_t)size_of_y(task) * sizeof *work.mu);
    for (int a = 0; a < states; a++) {
        work.mu[a] = -h * eta[a];
    }
    torques_at(stage, stage->v, p, i, work.torques);
    stage->node_calls++;
    if (node_curvature(task, x, work.torques, work.mu, y_of(stage, p, i), J_of(stage, p, i), work.H,
                       work.node)
        != 0) {
        return 1;
    }
    cost_of(task, work.torques, x + rates, work.slope, work.curvature);
    memset(work.g, 0, (size_t)zeta * sizeof *work.g);
    subtract_rows(states, eta, J, zeta, work.g, zeta);
    for (int a = 0; a < m; a++) {
        double *rate = work.H + (size_t)(rates + a) * zeta;
        double *torque = work.H + (size_t)(states + a) * zeta;
        torque[states + a] += h * weight * work.curvature[a];
        torque[rates + a] += h * weight * work.curvature[m + a];
        rate[states + a] += h * weight * work.curvature[m + a];
        rate[rates + a] += h * weight * work.curvature[2 * m + a];
        work.g[states + a] += weight * work.slope[a];
        work.g[rates + a] += weight * work.slope[m + a];
    }
    return 0;
}

/* b (n) += factors (zeta) times dzeta / dv, of a node: its states' slopes S, and its basis. */
static void add_along(const Stage *stage, double *factors, const double *S, const double *basis,
                      double *b)
{
    const Task *task = stage->task;
    const int m = task->tail, n = stage->variables, states = states_of(task);
    for (int a = 0; a < states; a++) {
        factors[a] = -factors[a];
    }
    subtract_rows(states, factors, S, n, b, n);
    for (int j = 0; j < task->coefficients; j++) {
        for (int a = 0; a < m; a++) {
            b[j * m + a] += basis[j] * factors[states + a];
        }
    }
}

/* H += Z^T (work.H) Z, lower triangle, with Z = dzeta / dv of a node. */
static void add_squared(const Stage *stage, const double *S, const double *basis, Work work,
                        double *H)
{
    const Task *task = stage->task;
    const int m = task->tail, n = stage->variables, states = states_of(task);
    const int zeta = size_of_zeta(task);
    memset(work.W, 0, (size_t)zeta * n * sizeof *work.W);
    for (int i = 0; i < zeta; i++) {
        add_along(stage, work.H + (size_t)i * zeta, S, basis, work.W + (size_t)i * n);
    }
    for (int r = 0; r < n; r++) {
        for (int a = 0; a < states; a++) {
            work.column[a] = -S[(size_t)a * n + r];
        }
        subtract_rows(states, work.column, work.W, n, H + (size_t)r * n, r + 1);
    }
    for (int j = 0; j < task->coefficients; j++) {
        for (int a = 0; a < m; a++) {
            const int r = j * m + a;
            const double factor = -basis[j];
            subtract_rows(1, &factor, work.W + (size_t)(states + a) * n, n, H + (size_t)r * n,
                          r + 1);
        }
    }
}

/* H += what the duration, that h is proportional to, has with the slope work.g of a node. */
static void add_duration(const Stage *stage, int p, const double *S, const double *basis,
                         Work work, double *H)
{
    const int n = stage->variables;
    double *last = H + (size_t)(n - 1) * n;
    memset(work.column, 0, (size_t)n * sizeof *work.column);
    add_along(stage, work.g, S, basis, work.column);
    for (int c = 0; c < n; c++) {
        last[c] += width_of(stage, p) * work.column[c] * (c == n - 1 ? 2 : 1);
    }
}

/* H (variables, variables) of mu^T r at v; 1 where it cannot be had. */
int stage_hessian(Stage *stage, const double *v, const double *mu, double *H)
{
    const Task *task = stage->task;
    const int n = stage->variables, states = states_of(task), K = task->nodes;
    const Work work = work_of(stage);
    if (stage_slopes(stage, v) != 0) {
        return 1;
    }
    memset(H, 0, (size_t)n * n * sizeof *H);
    memcpy(work.start, mu, (size_t)states * sizeof *mu);
    for (int p = stage->pieces - 1; p >= 0; p--) {
        adjoint(stage, mu, p, work);
        for (int i = 0; i < K; i++) {
            const double *S = stage->slopes + ((size_t)p * K + i) * states * n;
            const double *basis = basis_of(stage, p, i);
            if (at_node(stage, mu[stage->results - 1], p, i, work) != 0) {
                return 1;
            }
            add_squared(stage, S, basis, work, H);
            add_duration(stage, p, S, basis, work, H);
        }
    }
    for (int r = 0; r < n; r++) {
        for (int c = 0; c < r; c++) {
            H[(size_t)c * n + r] = H[(size_t)r * n + c];
        }
    }
    return !is_moderate(H, (size_t)n * n);
}

/* The Hessian of a stage's results: with the adjoint eta of the collocation equations F = 0, it is
   that of mu^T r + eta^T F along dz / dv, by the implicit function theorem. */

#include "stage_layout.h"

/* Scratch of a Hessian, after what a node needs. */
typedef struct {
    double *eta, *mu, *H, *W, *g, *column, *start;
} Work;

static Work work_of(const Stage *stage)
{
    const Phase *phase = stage->phase;
    const size_t zeta = (size_t)zeta_of(phase->node), n = (size_t)stage->variables;
    Work work;
    work.eta = stage->scratch + collocation_scratch(stage) - unknowns_of(phase);
    work.mu = stage->scratch + collocation_scratch(stage);
    work.H = work.mu + y_of_node(phase->node);
    work.W = work.H + zeta * zeta;
    work.g = work.W + zeta * n;
    work.column = work.g + zeta;
    work.start = work.column + n;
    return work;
}

/* The part of mu that belongs to the rows of a node, after its bounded states. */
static const double *mu_of_rows(const Stage *stage, const double *mu, int node)
{
    return mu + first_row_of_node(stage, node) + rows_of_node(stage, node)
         - stage->phase->node->rows;
}

/* eta of interval p: G^T eta = - the slope by z of all that comes after.  start: what the next
   interval's equations add at this one's end; becomes what this one's add. */
static void adjoint(Stage *stage, const double *mu, int p, Work work)
{
    const Phase *phase = stage->phase;
    const int K = phase->nodes, states = states_of(phase), zeta = zeta_of(phase->node);
    const int rows = phase->node->rows;
    double *eta = work.eta;
    memset(eta, 0, (size_t)unknowns_of(phase) * sizeof *eta);
    for (int i = 0; i < K; i++) {
        const int node = p * K + i, last = node + 1 == node_count(stage);
        const double *J = J_of(stage, p, i) + (size_t)states * zeta;
        const double price = mu[stage->results - 1] * duration_of(stage, stage->v, p)
                           * phase->weights[i];
        double *own = eta + (size_t)i * states;
        for (int b = 0; !last && b < phase->bounded; b++) {
            own[phase->bounded_states[b]] -= mu[first_row_of_node(stage, node) + b];
        }
        subtract_rows(rows, mu_of_rows(stage, mu, node), J, zeta, own, states);
        subtract_rows(1, &price, J + (size_t)rows * zeta, zeta, own, states);
    }
    for (int a = 0; a < states; a++) {
        eta[(size_t)(K - 1) * states + a] -= work.start[a];
    }
    solve_transposed(unknowns_of(phase), factors_of(stage, p), pivots_of(stage, p), eta);
    for (int a = 0; a < states; a++) {
        work.start[a] = 0.0;
        for (int i = 0; i < K; i++) {
            work.start[a] += phase->states[(size_t)i * (K + 1)] * eta[(size_t)i * states + a];
        }
    }
}

/* Second derivatives by zeta of what a node adds, in H, and its slope by zeta over h, in g; the
   node's own rows do not grow with h. */
static int at_node(Stage *stage, const double *mu, int p, int i, Work work)
{
    const Phase *phase = stage->phase;
    const int states = states_of(phase), rows = phase->node->rows, zeta = zeta_of(phase->node);
    const int node = p * phase->nodes + i;
    const double h = duration_of(stage, stage->v, p), *eta = work.eta + (size_t)i * states;
    const double price = mu[stage->results - 1] * phase->weights[i];
    double *J = J_of(stage, p, i);
    for (int a = 0; a < states; a++) {
        work.mu[a] = -h * eta[a];
    }
    memcpy(work.mu + states, mu_of_rows(stage, mu, node), (size_t)rows * sizeof *mu);
    work.mu[states + rows] = h * price;
    if (evaluate_node(stage, stage->v, p, i, stage->z + (size_t)node * states, work.mu, J, work.H)
        != 0) {
        return 1;
    }
    const double less = -price;
    memset(work.g, 0, (size_t)zeta * sizeof *work.g);
    subtract_rows(states, eta, J, zeta, work.g, zeta);
    subtract_rows(1, &less, J + (size_t)(states + rows) * zeta, zeta, work.g, zeta);
    return 0;
}

/* H += Z^T (work.H) Z, lower triangle, with Z = dzeta / dv of a node. */
static void add_squared(const Stage *stage, const double *S, const double *basis, Work work,
                        double *H)
{
    const Phase *phase = stage->phase;
    const Node *node = phase->node;
    const int n = stage->variables, states = node->states, controls = node->controls;
    const int zeta = zeta_of(node), first = n - node->constants;
    memset(work.W, 0, (size_t)zeta * n * sizeof *work.W);
    for (int i = 0; i < zeta; i++) {
        double *row = work.H + (size_t)i * zeta, *b = work.W + (size_t)i * n;
        for (int a = 0; a < states; a++) {
            work.column[a] = -row[a];
        }
        subtract_rows(states, work.column, S, n, b, n);
        for (int j = 0; j < phase->coefficients; j++) {
            for (int a = 0; a < controls; a++) {
                b[j * controls + a] += basis[j] * row[states + a];
            }
        }
        for (int k = 0; k < node->constants; k++) {
            b[first + k] += row[states + controls + k];
        }
    }
    for (int r = 0; r < n; r++) {
        for (int a = 0; a < states; a++) {
            work.column[a] = -S[(size_t)a * n + r];
        }
        subtract_rows(states, work.column, work.W, n, H + (size_t)r * n, r + 1);
    }
    for (int j = 0; j < phase->coefficients; j++) {
        for (int a = 0; a < controls; a++) {
            const int r = j * controls + a;
            const double factor = -basis[j];
            subtract_rows(1, &factor, work.W + (size_t)(states + a) * n, n, H + (size_t)r * n,
                          r + 1);
        }
    }
    for (int k = 0; k < node->constants; k++) {
        const double factor = -1.0;
        subtract_rows(1, &factor, work.W + (size_t)(states + controls + k) * n, n,
                      H + (size_t)(first + k) * n, first + k + 1);
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
    const int n = stage->variables, states = states_of(stage->phase), K = stage->phase->nodes;
    if (stage_slopes(stage, v) != 0) {
        return 1;
    }
    const Work work = work_of(stage);
    memset(H, 0, (size_t)n * n * sizeof *H);
    memcpy(work.start, mu, (size_t)states * sizeof *mu);
    for (int p = stage->pieces - 1; p >= 0; p--) {
        adjoint(stage, mu, p, work);
        for (int i = 0; i < K; i++) {
            const double *S = stage->slopes + ((size_t)p * K + i) * states * n;
            const double *basis = basis_of(stage, p, i);
            if (at_node(stage, mu, p, i, work) != 0) {
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

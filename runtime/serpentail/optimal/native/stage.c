/* A stage: its memory, its results, and their first derivatives by the implicit function theorem. */

#include "stage_layout.h"

static double *next(double **memory, size_t count)
{
    double *own = *memory;
    if (own != NULL) {
        *memory += count;
    }
    return own;
}

/* What one call needs: in collocation.c, or in curvature.c, which has more. */
static size_t scratch_doubles(const Stage *stage)
{
    const Phase *phase = stage->phase;
    const size_t zeta = (size_t)zeta_of(phase->node), n = (size_t)stage->variables;
    return collocation_scratch(stage) + (size_t)y_of_node(phase->node) + zeta * (zeta + n + 1)
         + 2 * n + (size_t)states_of(phase);
}

/* Give a stage its arrays in memory (NULL: only count); returns how many doubles they take. */
size_t stage_lay_out(Stage *stage, const Phase *phase, int index, double *memory)
{
    const Node *node = phase->node;
    const int K = phase->nodes, states = states_of(phase), d = unknowns_of(phase);
    const size_t y = (size_t)y_of_node(node), zeta = (size_t)zeta_of(node);
    stage->phase = phase;
    stage->first = phase->first[index];
    stage->pieces = phase->first[index + 1] - stage->first;
    stage->variables = coefficients_of(phase) + states + node->constants;
    stage->results = first_row_of_node(stage, stage->pieces * K) - phase->bounded + 1;

    const size_t n = (size_t)stage->variables, pieces = (size_t)stage->pieces, z = pieces * d;
    const size_t counts[] = {n, z, pieces * K * y, (size_t)stage->results, pieces * K * y * zeta,
                             z * d, z * n, (size_t)stage->results * n, n, z,
                             scratch_doubles(stage), n, (size_t)stage->results, n * n};
    double **arrays[] = {&stage->v, &stage->z, &stage->y, &stage->r, &stage->J, &stage->factors,
                         &stage->slopes, &stage->Jr, &stage->from_v, &stage->from_z,
                         &stage->scratch, &stage->given, &stage->mu, &stage->H};
    size_t sum = 0;
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
        *arrays[k] = next(&memory, counts[k]);
        sum += counts[k];
    }
    return sum;
}

size_t stage_pivots(const Stage *stage)
{
    return (size_t)stage->pieces * unknowns_of(stage->phase);
}

static void write_results(Stage *stage, const double *v)
{
    const Phase *phase = stage->phase;
    const int K = phase->nodes, states = states_of(phase), rows = phase->node->rows;
    const int count = node_count(stage);
    double cost = 0.0;
    for (int node = 0; node < count; node++) {
        const int p = node / K, i = node % K, last = node + 1 == count;
        const double *x = stage->z + (size_t)node * states, *y = y_of(stage, p, i) + states;
        double *own = stage->r + first_row_of_node(stage, node);
        for (int b = 0; !last && b < phase->bounded; b++) {
            own[b] = x[phase->bounded_states[b]];
        }
        memcpy(own + (last ? 0 : phase->bounded), y, (size_t)rows * sizeof *y);
        cost += duration_of(stage, v, p) * phase->weights[i] * y[rows];
    }
    memcpy(stage->r, stage->z + (size_t)(count - 1) * states, (size_t)states * sizeof *stage->r);
    stage->r[stage->results - 1] = cost;
}

static int same(const double *a, const double *b, int count)
{
    return memcmp(a, b, (size_t)count * sizeof *a) == 0;
}

int stage_values(Stage *stage, const double *v)
{
    if (stage->known && same(v, stage->v, stage->variables)) {
        return stage->failed;
    }
    memcpy(stage->v, v, (size_t)stage->variables * sizeof *v);
    stage->known = 1;
    stage->failed = 0;
    for (int p = 0; p < stage->pieces && !stage->failed; p++) {
        stage->failed = collocate(stage, v, p);
    }
    if (stage->failed) {
        stage->factored = 0;
        for (int k = 0; k < stage->results; k++) {
            stage->r[k] = FAR;
        }
        return 1;
    }
    write_results(stage, v);
    return 0;
}

void add_along(const Stage *stage, const double *row, const double *S, const double *basis,
               double *b)
{
    const Phase *phase = stage->phase;
    const Node *node = phase->node;
    const int n = stage->variables, states = node->states, first = n - node->constants;
    for (int a = 0; a < states; a++) {
        const double factor = row[a];
        for (int c = 0; factor != 0.0 && c < n; c++) {
            b[c] += factor * S[(size_t)a * n + c];
        }
    }
    row += states;
    for (int j = 0; j < phase->coefficients; j++) {
        for (int a = 0; a < node->controls; a++) {
            b[j * node->controls + a] += basis[j] * row[a];
        }
    }
    row += node->controls;
    for (int k = 0; k < node->constants; k++) {
        b[first + k] += row[k];
    }
}

/* - dF / dv of the equations of interval p, with the slopes of the one before. */
static void write_right_side(Stage *stage, int p)
{
    const Phase *phase = stage->phase;
    const Node *node = phase->node;
    const int K = phase->nodes, C = phase->coefficients, n = stage->variables;
    const int states = node->states, controls = node->controls, zeta = zeta_of(node);
    const double width = width_of(stage, p), h = duration_of(stage, stage->v, p);
    double *S = slopes_of(stage, p);
    const double *before = S - (size_t)states * n; /* of the interval before, at its end */
    memset(S, 0, (size_t)unknowns_of(phase) * n * sizeof *S);
    for (int i = 0; i < K; i++) {
        const double first = phase->states[(size_t)i * (K + 1)], *basis = basis_of(stage, p, i);
        const double *J = J_of(stage, p, i), *f = y_of(stage, p, i);
        for (int a = 0; a < states; a++) {
            double *row = S + ((size_t)i * states + a) * n;
            const double *by_u = J + (size_t)a * zeta + states, *by_p = by_u + controls;
            if (p == 0) {
                row[C * controls + a] = -first;
            } else {
                subtract_rows(1, &first, before + (size_t)a * n, n, row, n);
            }
            for (int j = 0; j < C; j++) {
                for (int b = 0; b < controls; b++) {
                    row[j * controls + b] += h * basis[j] * by_u[b];
                }
            }
            for (int k = 0; k < node->constants; k++) {
                row[n - node->constants + k] += h * by_p[k];
            }
            row[n - 1] += width * f[a];
        }
    }
}

static void write_result_slopes(Stage *stage)
{
    const Phase *phase = stage->phase;
    const int n = stage->variables, K = phase->nodes, states = states_of(phase);
    const int rows = phase->node->rows, zeta = zeta_of(phase->node), count = node_count(stage);
    double *cost = stage->Jr + (size_t)(stage->results - 1) * n, *along = stage->scratch;
    memset(stage->Jr, 0, (size_t)stage->results * n * sizeof *cost);
    for (int node = 0; node < count; node++) {
        const int p = node / K, i = node % K, last = node + 1 == count;
        const double *S = stage->slopes + (size_t)node * states * n;
        const double *basis = basis_of(stage, p, i), *y = y_of(stage, p, i) + states;
        const double *J = J_of(stage, p, i) + (size_t)states * zeta;
        double *own = stage->Jr + (size_t)first_row_of_node(stage, node) * n;
        for (int b = 0; !last && b < phase->bounded; b++, own += n) {
            memcpy(own, S + (size_t)phase->bounded_states[b] * n, (size_t)n * sizeof *own);
        }
        for (int r = 0; r < rows; r++, own += n) {
            add_along(stage, J + (size_t)r * zeta, S, basis, own);
        }
        const double h = duration_of(stage, stage->v, p) * phase->weights[i];
        for (int j = 0; j < zeta; j++) {
            along[j] = h * J[(size_t)rows * zeta + j];
        }
        add_along(stage, along, S, basis, cost);
        cost[n - 1] += width_of(stage, p) * phase->weights[i] * y[rows];
    }
    memcpy(stage->Jr, stage->slopes + (size_t)(count - 1) * states * n,
           (size_t)states * n * sizeof *cost);
}

int stage_slopes(Stage *stage, const double *v)
{
    const int d = unknowns_of(stage->phase), n = stage->variables;
    if (stage_values(stage, v) != 0) {
        return 1;
    }
    if (stage->sloped && same(v, stage->from_v, n)) {
        return 0;
    }
    stage->sloped = stage->factored = 0;
    for (int p = 0; p < stage->pieces; p++) {
        if (linearise(stage, v, p, stage->z + (size_t)p * d) != 0) {
            return 1;
        }
        write_right_side(stage, p);
        solve(d, factors_of(stage, p), pivots_of(stage, p), n, slopes_of(stage, p));
        if (!is_moderate(slopes_of(stage, p), (size_t)d * n)) {
            return 1;
        }
    }
    write_result_slopes(stage);
    if (!is_moderate(stage->Jr, (size_t)stage->results * n)) {
        return 1;
    }
    memcpy(stage->from_v, v, (size_t)n * sizeof *v);
    memcpy(stage->from_z, stage->z, (size_t)stage->pieces * d * sizeof *v);
    stage->sloped = stage->factored = 1;
    return 0;
}

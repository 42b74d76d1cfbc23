/* A stage: its memory, its results, and their first derivatives by the implicit function theorem. */

#include <string.h>

#include "stage_layout.h"

static double *next(double **memory, size_t count)
{
    double *own = *memory;
    if (own != NULL) {
        *memory += count;
    }
    return own;
}

/* What one call needs: in collocation.c three residuals, in curvature.c its Work. */
static size_t scratch_doubles(const Stage *stage)
{
    const Task *task = stage->task;
    const size_t m = (size_t)task->tail, zeta = (size_t)size_of_zeta(task);
    const size_t n = (size_t)stage->variables, d = (size_t)unknowns_of(task);
    return 6 * m + node_scratch(task) + 3 * d + (size_t)size_of_y(task) + zeta * (zeta + n + 1) + n
         + (size_t)states_of(task);
}

/* Give a stage its arrays in memory (NULL: only count); returns how many doubles they take. */
size_t stage_lay_out(Stage *stage, const Task *task, int index, double *memory)
{
    const int m = task->tail, K = task->nodes, states = states_of(task), d = unknowns_of(task);
    const int angle = task->most_angle != NULL, rate = task->most_rate != NULL;
    const size_t y = (size_t)size_of_y(task), zeta = (size_t)size_of_zeta(task);
    stage->task = task;
    stage->first = task->first[index];
    stage->pieces = task->first[index + 1] - stage->first;
    stage->variables = task->coefficients * m + states + 1;
    stage->bounded = m * (angle + rate);
    stage->first_bounded = ATTITUDE + (angle ? 0 : m);
    stage->results = states + (stage->pieces * K - 1) * stage->bounded + 1;

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
    return (size_t)stage->pieces * unknowns_of(stage->task);
}

static double *result_of_node(const Stage *stage, double *rows, int node, int columns)
{
    return rows + ((size_t)states_of(stage->task) + (size_t)node * stage->bounded) * columns;
}

static void write_results(Stage *stage, const double *v)
{
    const Task *task = stage->task;
    const int m = task->tail, K = task->nodes, states = states_of(task);
    const int last = stage->pieces * K - 1;
    double *torques = stage->scratch, cost = 0.0;
    for (int node = 0; node <= last; node++) {
        const int p = node / K, i = node % K;
        const double *x = stage->z + (size_t)node * states;
        torques_at(stage, v, p, i, torques);
        cost += v[stage->variables - 1] * width_of(stage, p) * task->weights[i]
              * cost_of(task, torques, x + ATTITUDE + m, NULL, NULL);
        if (node < last) {
            memcpy(result_of_node(stage, stage->r, node, 1), x + stage->first_bounded,
                   (size_t)stage->bounded * sizeof *x);
        } else {
            memcpy(stage->r, x, (size_t)states * sizeof *x);
        }
    }
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

/* - dF / dv of the equations of interval p, with the slopes of the one before. */
static void write_right_side(Stage *stage, int p)
{
    const Task *task = stage->task;
    const int m = task->tail, K = task->nodes, C = task->coefficients, n = stage->variables;
    const int states = states_of(task), zeta = size_of_zeta(task);
    const double width = width_of(stage, p), h = stage->v[n - 1] * width;
    double *S = slopes_of(stage, p);
    const double *before = S - (size_t)states * n; /* of the interval before, at its end */
    memset(S, 0, (size_t)unknowns_of(task) * n * sizeof *S);
    for (int i = 0; i < K; i++) {
        const double first = task->states[(size_t)i * (K + 1)], *basis = basis_of(stage, p, i);
        const double *J = J_of(stage, p, i), *f = y_of(stage, p, i);
        for (int a = 0; a < states; a++) {
            double *row = S + ((size_t)i * states + a) * n;
            if (p == 0) {
                row[C * m + a] = -first;
            } else {
                const double factor = first;
                subtract_rows(1, &factor, before + (size_t)a * n, n, row, n);
            }
            for (int j = 0; j < C; j++) {
                for (int b = 0; b < m; b++) {
                    row[j * m + b] += h * basis[j] * J[(size_t)a * zeta + states + b];
                }
            }
            row[n - 1] += width * f[a];
        }
    }
}

/* What a node's cost adds to the Jacobian's last row. */
static void add_cost_slopes(Stage *stage, int node, double *row)
{
    const Task *task = stage->task;
    const int m = task->tail, K = task->nodes, n = stage->variables, states = states_of(task);
    const int p = node / K, i = node % K;
    const double *x = stage->z + (size_t)node * states, *basis = basis_of(stage, p, i);
    const double *S = stage->slopes + ((size_t)node * states + ATTITUDE + m) * n;
    double *torques = stage->scratch, *slope = torques + m;
    const double weight = width_of(stage, p) * task->weights[i], h = stage->v[n - 1] * weight;
    torques_at(stage, stage->v, p, i, torques);
    row[n - 1] += weight * cost_of(task, torques, x + ATTITUDE + m, slope, NULL);
    for (int j = 0; j < task->coefficients; j++) {
        for (int a = 0; a < m; a++) {
            row[j * m + a] += h * basis[j] * slope[a];
        }
    }
    for (int a = 0; a < m; a++) {
        slope[m + a] *= -h;
    }
    subtract_rows(m, slope + m, S, n, row, n);
}

static void write_result_slopes(Stage *stage)
{
    const Task *task = stage->task;
    const int n = stage->variables, states = states_of(task);
    const int last = stage->pieces * task->nodes - 1;
    double *cost = stage->Jr + (size_t)(stage->results - 1) * n;
    memset(cost, 0, (size_t)n * sizeof *cost);
    for (int node = 0; node <= last; node++) {
        const double *S = stage->slopes + (size_t)node * states * n;
        add_cost_slopes(stage, node, cost);
        if (node < last) {
            memcpy(result_of_node(stage, stage->Jr, node, n), S + (size_t)stage->first_bounded * n,
                   (size_t)stage->bounded * n * sizeof *S);
        } else {
            memcpy(stage->Jr, S, (size_t)states * n * sizeof *S);
        }
    }
}

int stage_slopes(Stage *stage, const double *v)
{
    const int d = unknowns_of(stage->task), n = stage->variables;
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
    memcpy(stage->from_v, v, (size_t)n * sizeof *v);
    memcpy(stage->from_z, stage->z, (size_t)stage->pieces * d * sizeof *v);
    stage->sloped = stage->factored = 1;
    return 0;
}

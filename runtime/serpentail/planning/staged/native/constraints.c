/* The constraints of the whole program, but that of the stages to follow each other. */

#include <math.h>
#include <string.h>

#include "stage_layout.h"
#include "ocp.h"

/* ---- inequalities: torques, states at the start or the duration, states at inner nodes */

/* The largest magnitude of bounded state b. */
static double most_of(const Task *task, int b)
{
    const int m = task->tail;
    if (task->most_angle == NULL) {
        return task->most_rate[b];
    }
    return b < m ? task->most_angle[b] : task->most_rate[b - m];
}

static int write_limit(double *least, double *most, int row, double largest)
{
    least[row] = -largest;
    most[row] = largest;
    return row + 1;
}

void limits_of(const Program *program, int k, double *least, double *most)
{
    const Task *task = program->task;
    const int N = task->stages, bounded = program->stages->bounded;
    const int first = program->stages->first_bounded;
    int row = 0;
    for (int c = 0; k < N && task->most_torque != NULL && c < torques_of(task); c++) {
        row = write_limit(least, most, row, task->most_torque[c % task->tail]);
    }
    for (int b = 0; k > 0 && b < bounded; b++) {
        if (k < N || !is_given(task, first + b)) {
            row = write_limit(least, most, row, most_of(task, b));
        }
    }
    if (k == 0 && duration_is_free(task)) {
        least[row] = task->shortest;
        most[row++] = task->longest;
    }
    for (int c = 0; k == N && c < sizes_of(program, N).controls; c++) {
        row = write_limit(least, most, row, MOST_GIVEN);
    }
    for (int r = 0; k < N && r < inner_rows(program->stages + k); r++) {
        row = write_limit(least, most, row, most_of(task, r % bounded));
    }
}

int inequalities_of(Program *program, int k, const double *u, const double *s, double *values)
{
    const Task *task = program->task;
    const int N = task->stages, bounded = program->stages->bounded;
    const int first = program->stages->first_bounded;
    int row = 0;
    for (int c = 0; k < N && task->most_torque != NULL && c < torques_of(task); c++) {
        values[row++] = u[c];
    }
    for (int b = 0; k > 0 && b < bounded; b++) {
        if (k < N || !is_given(task, first + b)) {
            values[row++] = s[first + b];
        }
    }
    if (k == 0 && duration_is_free(task)) {
        values[row++] = s[0];
    }
    for (int c = 0; k == N && c < sizes_of(program, N).controls; c++) {
        values[row++] = u[c];
    }
    if (k == N || inner_rows(program->stages + k) == 0) {
        return 0;
    }
    const int failed = valued(program, k, u, s) == NULL; /* r is far from any bound then */
    memcpy(values + row, program->stages[k].r + states_of(task),
           (size_t)inner_rows(program->stages + k) * sizeof *values);
    return failed;
}

int inequality_slopes(Program *program, int k, const double *u, const double *s, double *slopes)
{
    const Task *task = program->task;
    const int N = task->stages, bounded = program->stages->bounded;
    const int first = program->stages->first_bounded;
    const Sizes sizes = sizes_of(program, k);
    const int columns = sizes.controls + sizes.states;
    int row = 0;
    memset(slopes, 0, (size_t)sizes.inequalities * columns * sizeof *slopes);
    for (int c = 0; k < N && task->most_torque != NULL && c < torques_of(task); c++) {
        slopes[(size_t)row++ * columns + c] = 1.0;
    }
    for (int b = 0; k > 0 && b < bounded; b++) {
        if (k < N || !is_given(task, first + b)) {
            slopes[(size_t)row++ * columns + sizes.controls + first + b] = 1.0;
        }
    }
    if (k == 0 && duration_is_free(task)) {
        slopes[(size_t)row++ * columns + sizes.controls] = 1.0;
    }
    for (int c = 0; k == N && c < sizes.controls; c++) {
        slopes[(size_t)row++ * columns + c] = 1.0;
    }
    if (k == N || inner_rows(program->stages + k) == 0) {
        return 0;
    }
    const int failed = sloped(program, k, u, s) == NULL; /* Jr is that of the last slopes then */
    const Stage *stage = program->stages + k;
    for (int r = 0; r < inner_rows(program->stages + k); r++, row++) {
        const double *own = stage->Jr + ((size_t)states_of(task) + r) * stage->variables;
        for (int c = 0; c < columns; c++) {
            slopes[(size_t)row * columns + c] = own[column_of(program, k, c)];
        }
    }
    return failed;
}

/* ---- the goal: rows of the attitude, given entries of the state, the given angular velocity */

/* A row of slopes by the states of the end, all others of which are zero. */
static double *state_slopes(const Sizes *sizes, double *slopes, int row)
{
    return slopes + (size_t)row * (sizes->controls + sizes->states) + sizes->controls;
}

int goal_of(Program *program, const double *u, const double *s, double *values, double *slopes)
{
    const Task *task = program->task;
    const int states = states_of(task), zeta = size_of_zeta(task);
    const Sizes sizes = sizes_of(program, task->stages);
    const int columns = sizes.controls + sizes.states;
    int row = 0;
    memset(slopes, 0, (size_t)sizes.equalities * columns * sizeof *slopes);
    for (; row < task->goal_rows; row++) {
        values[row] = 0.0;
        for (int a = 0; a < ATTITUDE; a++) {
            state_slopes(&sizes, slopes, row)[a] = task->goal[row * ATTITUDE + a];
            values[row] += task->goal[row * ATTITUDE + a] * s[a];
        }
    }
    for (int a = 0; a < states; a++) {
        if (is_given(task, a)) {
            state_slopes(&sizes, slopes, row)[a] = 1.0;
            values[row++] = s[a] - task->end_state[a];
        }
    }
    const int failed = row < sizes.equalities
                    && node_slopes(task, s, program->still, program->y, program->J,
                                   program->scratch);
    for (int a = 0; a < TURN; a++) {
        if (!isnan(task->end_turn[a])) {
            memcpy(state_slopes(&sizes, slopes, row), program->J + (size_t)(states + a) * zeta,
                   (size_t)states * sizeof *slopes);
            values[row++] = program->y[states + a] - task->end_turn[a];
        }
    }
    if (failed) {
        values[sizes.equalities - 1] = FAR;
    }
    for (row = 0; row < sizes.equalities; row++) {
        slopes[(size_t)row * columns + row] = -1.0;
        values[row] -= u[row] + program->shift[row];
    }
    return failed;
}

/* Row by row of a node's zeta; NULL where it cannot be had. */
const double *goal_curved(Program *program, const double *s, const double *lambda)
{
    const Task *task = program->task;
    const int states = states_of(task), zeta = states + task->tail;
    int row = sizes_of(program, task->stages).equalities;
    double *mu = program->mu;
    memset(mu, 0, (size_t)(states + TURN) * sizeof *mu);
    memset(program->H, 0, (size_t)zeta * zeta * sizeof *mu);
    for (int a = TURN - 1; a >= 0; a--) { /* they are the last rows */
        if (!isnan(task->end_turn[a])) {
            mu[states + a] = lambda[--row];
        }
    }
    if (row == sizes_of(program, task->stages).equalities) {
        return program->H;
    }
    const int failed = node_curvature(task, s, program->still, mu, program->y, program->J,
                                      program->H, program->scratch);
    return failed ? NULL : program->H;
}

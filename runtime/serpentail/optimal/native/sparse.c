/* The whole program for a solver of sparse programs: constraints stage by stage, each with what the
   stage leads to, its equalities and its inequalities; derivatives in dense blocks of these. */

#include <stdlib.h>

#include "stage_layout.h"
#include "ocp.h"

void sparse_values(Program *program, const double *w, double *f, double *g)
{
    const int N = program->ocp->phase.stages;
    program_values(program, w);
    *f = cost_of(program, w);
    for (int k = 0; k <= N; k++) {
        const Sizes sizes = sizes_of(program, k);
        if (k < N) {
            defects_of(program, k, w, g);
            g += sizes_of(program, k + 1).states;
        }
        equalities_of(program, k, w, g);
        inequalities_of(program, k, w, g + sizes.equalities);
        g += sizes.equalities + sizes.inequalities;
    }
}

/* Of the stages where they were evaluated last. */
double sparse_cost(Program *program)
{
    return stages_cost(program);
}

int sparse_stages(const Program *program)
{
    return program->ocp->phase.stages;
}

/* Multipliers of the constants' limits, of those of g. */
void sparse_multipliers(const Program *program, const double *lambda, double *found)
{
    constant_multipliers(program, lambda + sizes_of(program, 1).states
                                      + sizes_of(program, 0).equalities, found);
}

/* Least and most of g. */
void sparse_limits(Program *program, double *least, double *most)
{
    const int N = program->ocp->phase.stages;
    for (int k = 0; k <= N; k++) {
        const Sizes sizes = sizes_of(program, k);
        const int zero = sizes.equalities + (k < N ? sizes_of(program, k + 1).states : 0);
        memset(least, 0, (size_t)zero * sizeof *least);
        memset(most, 0, (size_t)zero * sizeof *most);
        limits_of(program, k, least + zero, most + zero);
        least += zero + sizes.inequalities;
        most += zero + sizes.inequalities;
    }
}

/* The gradient of f, and blocks: slopes of a stage's rows by its own variables.  1 where there are
   none. */
int sparse_slopes(Program *program, const double *w, double *gradient, double *blocks)
{
    const int N = program->ocp->phase.stages;
    int failed = 0;
    program_slopes(program, w);
    for (int k = 0; k <= N; k++) {
        const Sizes sizes = sizes_of(program, k);
        const int columns = sizes.controls + sizes.states;
        failed |= k < N && !program->stages[k].sloped;
        cost_slopes(program, k, w, gradient + program->offsets[k]);
        if (k < N) {
            defect_slopes(program, k, w, blocks);
            blocks += sizes_of(program, k + 1).states * columns;
        }
        failed |= equality_slopes(program, k, w, blocks);
        inequality_slopes(program, k, w, blocks + sizes.equalities * columns);
        blocks += (sizes.equalities + sizes.inequalities) * columns;
    }
    return failed;
}

/* Blocks of the Hessian of scale f + lambda^T g, one for each stage. */
int sparse_curve(Program *program, const double *w, double scale, const double *lambda,
                 double *blocks)
{
    const int N = program->ocp->phase.stages;
    int failed = 0, row = 0, *next = calloc(2 * ((size_t)N + 1), sizeof *next);
    if (next == NULL) {
        return 1;
    }
    int *inner = next + N + 1;
    for (int k = 0; k <= N; k++) {
        const Sizes sizes = sizes_of(program, k);
        next[k] = row;
        row += sizes.equalities + (k < N ? sizes_of(program, k + 1).states : 0);
        inner[k] = row;
        row += sizes.inequalities;
    }
    program_curve(program, w, scale, lambda, next, inner);
    for (int k = 0; k <= N; k++) {
        const Sizes sizes = sizes_of(program, k);
        const size_t columns = (size_t)(sizes.controls + sizes.states);
        failed |= hessian_of(program, k, w, scale, lambda + inner[k] - sizes.equalities,
                             lambda + inner[k], blocks);
        blocks += columns * columns;
    }
    free(next);
    return failed;
}

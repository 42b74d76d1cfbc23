/* Stages in a row: memory, and how variables and constraints of the whole program are cut up. */

#include <math.h>
#include <stdlib.h>

#include "stage_layout.h"
#include "ocp.h"

/* ---- memory */

/* Doubles of all stages, laid out in memory unless that is NULL. */
static size_t lay_out(Program *program, double *memory)
{
    size_t sum = 0;
    for (int k = 0; k < program->ocp->phase.stages; k++) {
        sum += stage_lay_out(program->stages + k, &program->ocp->phase, k,
                             memory == NULL ? NULL : memory + sum);
    }
    return sum;
}

static size_t larger(size_t a, size_t b)
{
    return a > b ? a : b;
}

/* The most entries of the slopes of one stage's constraints, or of its Hessian. */
static size_t most_slopes(const Program *program)
{
    size_t most = 1;
    for (int k = 0; k <= program->ocp->phase.stages; k++) {
        const Sizes sizes = sizes_of(program, k);
        const size_t rows = (size_t)(sizes.equalities + sizes.inequalities + sizes.states
                                     + states_of(&program->ocp->phase) + program->ocp->free);
        const size_t columns = (size_t)(sizes.controls + sizes.states + 1);
        most = larger(most, larger(rows, columns) * (columns + 1));
    }
    return most;
}

/* Doubles of the program's own arrays, laid out in memory unless that is NULL. */
static size_t own_doubles(Program *program, double *memory)
{
    const Ocp *ocp = program->ocp;
    const Node *node = ocp->phase.node, *ends[] = {ocp->at_start, ocp->at_end};
    const size_t zeta = (size_t)zeta_of(node);
    size_t y = (size_t)y_of_node(node), scratch = node_scratch(node), sum = 0;
    for (int k = 0; k < 2; k++) {
        if (ends[k] != NULL) {
            y = larger(y, (size_t)y_of_node(ends[k]));
            scratch = larger(scratch, node_scratch(ends[k]));
        }
    }
    const size_t n = (size_t)(coefficients_of(&ocp->phase) + node->states + node->constants);
    const size_t counts[] = {zeta * zeta, y, n, y, y * zeta, scratch, (size_t)node->controls, y,
                             program->offsets == NULL ? 0 : most_slopes(program)};
    double **arrays[] = {&program->H, &program->mu, &program->v, &program->y, &program->J,
                         &program->scratch, &program->still, &program->shift, &program->rows};
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
        *arrays[k] = memory == NULL ? NULL : memory + sum;
        sum += counts[k];
    }
    return sum;
}

/* Blocks of memory: the program, its stages, all doubles, and all pivots with the offsets. */
Program *program_new(const Ocp *ocp)
{
    const int N = ocp->phase.stages;
    int one = 0;
    Program sketch = {.ocp = ocp, .stages = calloc((size_t)N, sizeof(Stage)), .offsets = &one};
    size_t doubles, pivots = 0;
    Program *program;
    if (sketch.stages == NULL) {
        return NULL;
    }
    doubles = lay_out(&sketch, NULL);
    doubles += own_doubles(&sketch, NULL);
    for (int k = 0; k < N; k++) {
        pivots += stage_pivots(sketch.stages + k);
    }
    program = calloc(1, sizeof *program);
    double *memory = calloc(doubles, sizeof *memory);
    int *places = calloc(pivots + (size_t)N + 2, sizeof *places);
    if (program == NULL || memory == NULL || places == NULL || crew_begin(&program->crew) != 0) {
        free(program);
        free(memory);
        free(places);
        free(sketch.stages);
        return NULL;
    }
    program->ocp = ocp;
    program->stages = sketch.stages;
    program->offsets = places;
    lay_out(program, memory + own_doubles(program, memory));
    for (int k = 0; k <= N; k++) {
        const Sizes sizes = sizes_of(program, k);
        program->offsets[k + 1] = program->offsets[k] + sizes.controls + sizes.states;
    }
    places += N + 2;
    for (int k = 0; k < N; k++) {
        program->stages[k].pivots = places;
        places += stage_pivots(program->stages + k);
    }
    return program;
}

void program_free(Program *program)
{
    crew_end(&program->crew);
    free(program->offsets);
    free(program->H); /* where the doubles begin */
    free(program->stages);
    free(program);
}

/* ---- sizes */

int is_limited(const double *least, const double *most, int k)
{
    return isfinite(least[k]) || isfinite(most[k]);
}

int count_limited(const double *least, const double *most, int count)
{
    int sum = 0;
    for (int k = 0; k < count; k++) {
        sum += is_limited(least, most, k);
    }
    return sum;
}

Sizes sizes_of(const Program *program, int k)
{
    const Ocp *ocp = program->ocp;
    const Phase *phase = &ocp->phase;
    const int N = phase->stages, has_x = k > 0 || ocp->start == NULL;
    Sizes sizes = {coefficients_of(phase), (has_x ? phase->node->states : 0) + ocp->free, 0, 0};
    if (k == N) {
        sizes.equalities = sizes.controls = ocp->at_end == NULL ? 0 : ocp->at_end->rows;
        sizes.inequalities = sizes.controls;
        for (int b = 0; b < phase->bounded; b++) {
            sizes.inequalities += !ocp->fixed[b];
        }
        return sizes;
    }
    if (k == 0) {
        const int rows = ocp->at_start == NULL ? 0 : ocp->at_start->rows;
        sizes.equalities = ocp->start_equalities;
        sizes.inequalities = rows - ocp->start_equalities
                           + count_limited(ocp->least_constant, ocp->most_constant, ocp->free);
    }
    sizes.inequalities += phase->coefficients
                            * count_limited(ocp->least_control, ocp->most_control,
                                            phase->node->controls)
                        + (has_x ? phase->bounded : 0) + inner_rows(program->stages + k);
    return sizes;
}

int program_variables(const Program *program)
{
    return program->offsets[program->ocp->phase.stages + 1];
}

int program_rows(const Program *program)
{
    int sum = 0;
    for (int k = 0; k <= program->ocp->phase.stages; k++) {
        const Sizes sizes = sizes_of(program, k);
        sum += sizes.equalities + sizes.inequalities + (k > 0 ? sizes.states : 0);
    }
    return sum;
}

void program_sizes(const Program *program, int *sizes)
{
    for (int k = 0; k <= program->ocp->phase.stages; k++) {
        const Sizes own = sizes_of(program, k);
        memcpy(sizes + 4 * k, &own, sizeof own);
    }
}

/* ---- states at the nodes */

void program_guess(Program *program, const double *z)
{
    const size_t size = (size_t)unknowns_of(&program->ocp->phase);
    for (int k = 0; k < program->ocp->phase.stages; k++) {
        Stage *stage = program->stages + k;
        stage->known = stage->sloped = stage->factored = 0;
        memcpy(stage->from_z, z + (size_t)stage->first * size,
               (size_t)stage->pieces * size * sizeof *z);
    }
}

void program_nodes(const Program *program, double *z)
{
    const size_t size = (size_t)unknowns_of(&program->ocp->phase);
    for (int k = 0; k < program->ocp->phase.stages; k++) {
        const Stage *stage = program->stages + k;
        memcpy(z + (size_t)stage->first * size, stage->z,
               (size_t)stage->pieces * size * sizeof *z);
    }
}

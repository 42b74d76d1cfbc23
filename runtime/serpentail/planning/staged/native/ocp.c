/* Stages in a row: how variables and constraints of the whole program are cut up. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "stage_layout.h"
#include "ocp.h"

/* ---- memory */

/* Doubles of all stages, laid out in memory unless that is NULL. */
static size_t lay_out(Program *program, double *memory)
{
    size_t sum = 0;
    for (int k = 0; k < program->task->stages; k++) {
        sum += stage_lay_out(program->stages + k, program->task, k,
                             memory == NULL ? NULL : memory + sum);
    }
    return sum;
}

static size_t most_variables(const Task *task)
{
    return (size_t)(torques_of(task) + states_of(task) + 1);
}

/* Doubles of the program's own arrays, laid out in memory unless that is NULL. */
static size_t own_doubles(Program *program, double *memory)
{
    const Task *task = program->task;
    const size_t n = most_variables(task), y = (size_t)(states_of(task) + TURN);
    const size_t zeta = (size_t)(states_of(task) + task->tail);
    size_t sum = 0;
    const size_t counts[] = {zeta * zeta, y, n, y, y * zeta, node_scratch(task),
                             (size_t)task->tail, (size_t)(task->goal_rows) + y};
    double **arrays[] = {&program->H, &program->mu, &program->v, &program->y, &program->J,
                         &program->scratch, &program->still, &program->shift};
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
        *arrays[k] = memory == NULL ? NULL : memory + sum;
        sum += counts[k];
    }
    return sum;
}

/* Blocks of memory: the program, its stages, all doubles, and all pivots with the offsets. */
Program *program_new(const Task *task)
{
    Program sketch = {.task = task, .stages = calloc((size_t)task->stages, sizeof(Stage))};
    size_t doubles, pivots = 0;
    Program *program;
    if (sketch.stages == NULL) {
        return NULL;
    }
    doubles = lay_out(&sketch, NULL);
    doubles += own_doubles(&sketch, NULL);
    for (int k = 0; k < task->stages; k++) {
        pivots += stage_pivots(sketch.stages + k);
    }
    program = calloc(1, sizeof *program);
    double *memory = calloc(doubles, sizeof *memory);
    int *places = calloc(pivots + (size_t)task->stages + 1, sizeof *places);
    if (program == NULL || memory == NULL || places == NULL || crew_begin(&program->crew) != 0) {
        free(program);
        free(memory);
        free(places);
        free(sketch.stages);
        return NULL;
    }
    program->task = task;
    program->stages = sketch.stages;
    lay_out(program, memory + own_doubles(program, memory));
    for (int k = 0; k < task->stages; k++) {
        program->stages[k].pivots = places;
        places += stage_pivots(program->stages + k);
    }
    program->offsets = places;
    for (int k = 0; k < task->stages; k++) {
        const Sizes sizes = sizes_of(program, k);
        places[k + 1] = places[k] + sizes.controls + sizes.states;
    }
    return program;
}

void program_free(Program *program)
{
    crew_end(&program->crew);
    free(program->stages[0].pivots);
    free(program->H); /* where the doubles begin */
    free(program->stages);
    free(program);
}

/* ---- variables */

static Sizes sizes_at_end(const Program *program)
{
    const Task *task = program->task;
    const Stage *any = program->stages;
    Sizes sizes = {0, states_of(task) + duration_is_free(task), task->goal_rows, 0};
    for (int a = 0; a < states_of(task); a++) {
        sizes.equalities += is_given(task, a);
    }
    for (int a = 0; a < TURN; a++) {
        sizes.equalities += !isnan(task->end_turn[a]);
    }
    for (int b = 0; b < any->bounded; b++) {
        sizes.inequalities += !is_given(task, any->first_bounded + b);
    }
    sizes.controls = sizes.equalities;
    sizes.inequalities += sizes.controls;
    return sizes;
}

Sizes sizes_of(const Program *program, int k)
{
    const Task *task = program->task;
    const int free_duration = duration_is_free(task);
    if (k == task->stages) {
        return sizes_at_end(program);
    }
    Sizes sizes = {torques_of(task), (k > 0 ? states_of(task) : 0) + free_duration, 0, 0};
    sizes.inequalities = (task->most_torque == NULL ? 0 : torques_of(task))
                       + (k > 0 ? program->stages[k].bounded : free_duration)
                       + inner_rows(program->stages + k);
    return sizes;
}

int column_of(const Program *program, int k, int c)
{
    const Task *task = program->task;
    return k == 0 && c >= torques_of(task) ? c + states_of(task) : c;
}

void variables_of(const Program *program, int k, const double *u, const double *s, double *v)
{
    const Task *task = program->task;
    const int controls = torques_of(task), states = states_of(task);
    memcpy(v, u, (size_t)controls * sizeof *v);
    memcpy(v + controls, k > 0 ? s : task->start, (size_t)states * sizeof *v);
    v[controls + states] = duration_is_free(task) ? s[k > 0 ? states : 0] : task->longest;
}

Stage *valued(Program *program, int k, const double *u, const double *s)
{
    Stage *stage = program->stages + k;
    variables_of(program, k, u, s, program->v);
    return stage_values(stage, program->v) == 0 ? stage : NULL;
}

Stage *sloped(Program *program, int k, const double *u, const double *s)
{
    Stage *stage = program->stages + k;
    variables_of(program, k, u, s, program->v);
    return stage_slopes(stage, program->v) == 0 ? stage : NULL;
}

/* ---- a motion on the program's stages */

int program_variables(const Program *program)
{
    int sum = 0;
    for (int k = 0; k <= program->task->stages; k++) {
        const Sizes sizes = sizes_of(program, k);
        sum += sizes.controls + sizes.states;
    }
    return sum;
}

int program_rows(const Program *program)
{
    int sum = 0;
    for (int k = 0; k <= program->task->stages; k++) {
        const Sizes sizes = sizes_of(program, k);
        sum += sizes.equalities + sizes.inequalities + (k > 0 ? sizes.states : 0);
    }
    return sum;
}

/* States (I, K, states) at the nodes, from where collocation begins. */
void program_guess(Program *program, const double *z)
{
    for (int k = 0; k < program->task->stages; k++) {
        Stage *stage = program->stages + k;
        const size_t size = (size_t)unknowns_of(program->task);
        stage->known = stage->sloped = stage->factored = 0;
        memcpy(stage->from_z, z + (size_t)stage->first * size,
               (size_t)stage->pieces * size * sizeof *z);
    }
}

/* States (I, K, states) and y (I, K, y) at the nodes where the stages were evaluated last. */
void program_nodes(const Program *program, double *z, double *y)
{
    const Task *task = program->task;
    const size_t size = (size_t)unknowns_of(task), own = (size_t)(task->nodes * size_of_y(task));
    for (int k = 0; k < task->stages; k++) {
        const Stage *stage = program->stages + k;
        const size_t first = (size_t)stage->first, pieces = (size_t)stage->pieces;
        memcpy(z + first * size, stage->z, pieces * size * sizeof *z);
        memcpy(y + first * own, stage->y, pieces * own * sizeof *y);
    }
}

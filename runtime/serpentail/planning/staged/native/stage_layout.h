/* Where a stage keeps what: sizes and places, for the files that work on it. */

#ifndef SERPENTAIL_INSIDE_H
#define SERPENTAIL_INSIDE_H

#include <math.h>

#include "stage.h"

static inline int states_of(const Task *task)
{
    return ATTITUDE + 2 * task->tail;
}

static inline int size_of_y(const Task *task)
{
    return states_of(task) + TURN;
}

static inline int size_of_zeta(const Task *task)
{
    return states_of(task) + task->tail;
}

/* Controls of a stage: coefficients of all torques. */
static inline int torques_of(const Task *task)
{
    return task->coefficients * task->tail;
}

static inline int duration_is_free(const Task *task)
{
    return task->longest > task->shortest;
}

/* Whether entry a of the state is given at the end. */
static inline int is_given(const Task *task, int a)
{
    return !isnan(task->end_state[a]);
}

/* Bounded states at the inner nodes of a stage. */
static inline int inner_rows(const Stage *stage)
{
    return (stage->pieces * stage->task->nodes - 1) * stage->bounded;
}

/* Unknowns of one interval. */
static inline int unknowns_of(const Task *task)
{
    return task->nodes * states_of(task);
}

/* The state where interval p of the stage starts. */
static inline const double *start_of(const Stage *stage, const double *v, int p)
{
    const Task *task = stage->task;
    if (p == 0) {
        return v + task->coefficients * task->tail;
    }
    return stage->z + (size_t)p * unknowns_of(task) - states_of(task);
}

static inline double width_of(const Stage *stage, int p)
{
    return stage->task->widths[stage->first + p];
}

static inline const double *basis_of(const Stage *stage, int p, int i)
{
    const Task *task = stage->task;
    return task->basis
         + ((size_t)(stage->first + p) * task->nodes + i) * task->coefficients;
}

static inline double *y_of(const Stage *stage, int p, int i)
{
    return stage->y + ((size_t)p * stage->task->nodes + i) * size_of_y(stage->task);
}

static inline double *J_of(const Stage *stage, int p, int i)
{
    const Task *task = stage->task;
    return stage->J
         + ((size_t)p * task->nodes + i) * size_of_y(task) * size_of_zeta(task);
}

static inline double *slopes_of(const Stage *stage, int p)
{
    return stage->slopes + (size_t)p * unknowns_of(stage->task) * stage->variables;
}

static inline double *factors_of(const Stage *stage, int p)
{
    const size_t d = (size_t)unknowns_of(stage->task);
    return stage->factors + (size_t)p * d * d;
}

static inline int *pivots_of(const Stage *stage, int p)
{
    return stage->pivots + (size_t)p * unknowns_of(stage->task);
}

/* collocation.c */
void torques_at(const Stage *stage, const double *v, int p, int i, double *torques);
int linearise(Stage *stage, const double *v, int p, const double *z); /* 1 where it fails */
int collocate(Stage *stage, const double *v, int p);                  /* 1 where it fails */

#endif

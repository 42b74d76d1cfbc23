/* Where a stage keeps what: sizes and places, for the files that work on it. */

#ifndef SERPENTAIL_STAGE_LAYOUT_H
#define SERPENTAIL_STAGE_LAYOUT_H

#include <math.h>
#include <string.h>

#include "stage.h"

static inline int states_of(const Phase *phase)
{
    return phase->node->states;
}

/* Coefficients of all controls of a stage. */
static inline int coefficients_of(const Phase *phase)
{
    return phase->coefficients * phase->node->controls;
}

/* Unknowns of one interval. */
static inline int unknowns_of(const Phase *phase)
{
    return phase->nodes * states_of(phase);
}

static inline int node_count(const Stage *stage)
{
    return stage->pieces * stage->phase->nodes;
}

/* Rows that a node of a stage adds to its results: the last one leaves bounded states out. */
static inline int rows_of_node(const Stage *stage, int node)
{
    const Phase *phase = stage->phase;
    return phase->node->rows + (node + 1 < node_count(stage) ? phase->bounded : 0);
}

/* Where these begin. */
static inline int first_row_of_node(const Stage *stage, int node)
{
    const Phase *phase = stage->phase;
    return states_of(phase) + node * (phase->bounded + phase->node->rows);
}

/* Rows of all nodes of a stage. */
static inline int inner_rows(const Stage *stage)
{
    return stage->results - states_of(stage->phase) - 1;
}

/* The state where interval p of the stage starts. */
static inline const double *start_of(const Stage *stage, const double *v, int p)
{
    const Phase *phase = stage->phase;
    return p == 0 ? v + coefficients_of(phase)
                  : stage->z + (size_t)p * unknowns_of(phase) - states_of(phase);
}

static inline const double *constants_of(const Stage *stage, const double *v)
{
    return v + coefficients_of(stage->phase) + states_of(stage->phase);
}

static inline double width_of(const Stage *stage, int p)
{
    return stage->phase->widths[stage->first + p];
}

/* The duration of interval p. */
static inline double duration_of(const Stage *stage, const double *v, int p)
{
    return v[stage->variables - 1] * width_of(stage, p);
}

static inline size_t place_of(const Stage *stage, int p, int i)
{
    return (size_t)(stage->first + p) * stage->phase->nodes + i;
}

static inline const double *basis_of(const Stage *stage, int p, int i)
{
    return stage->phase->basis + place_of(stage, p, i) * stage->phase->coefficients;
}

static inline double *y_of(const Stage *stage, int p, int i)
{
    return stage->y + ((size_t)p * stage->phase->nodes + i) * y_of_node(stage->phase->node);
}

static inline double *J_of(const Stage *stage, int p, int i)
{
    const Node *node = stage->phase->node;
    return stage->J + ((size_t)p * stage->phase->nodes + i) * y_of_node(node) * zeta_of(node);
}

static inline double *slopes_of(const Stage *stage, int p)
{
    return stage->slopes + (size_t)p * unknowns_of(stage->phase) * stage->variables;
}

static inline double *factors_of(const Stage *stage, int p)
{
    const size_t d = (size_t)unknowns_of(stage->phase);
    return stage->factors + (size_t)p * d * d;
}

static inline int *pivots_of(const Stage *stage, int p)
{
    return stage->pivots + (size_t)p * unknowns_of(stage->phase);
}

/* collocation.c */
/* Node i of interval p at states x; mu, J and H as of node_evaluate. */
int evaluate_node(Stage *stage, const double *v, int p, int i, const double *x, const double *mu,
                  double *J, double *H);
int linearise(Stage *stage, const double *v, int p, const double *z); /* 1 where it fails */
int collocate(Stage *stage, const double *v, int p);                  /* 1 where it fails */
size_t collocation_scratch(const Stage *stage);

/* stage.c: b (n) += row of (x, u, p) along v, at a node with its states' slopes S and its basis */
void add_along(const Stage *stage, const double *row, const double *S, const double *basis,
               double *b);

#endif

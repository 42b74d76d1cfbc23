/* A stage of an optimal control problem: what an interval-by-interval solver asks of it.

   A stage is a control interval: controls are one polynomial in it, whose Bernstein coefficients
   are the stage's own, and one or more intervals of the mesh lie in it.  Its variables are v =
   (coefficients, state at its start, constants), all in the program's units; the collocation
   equations of its intervals are solved inside.  What it gives are its results r = (state at its
   end, at each node bounded states, which the last node leaves out, and the node's rows, cost),
   their Jacobian, and the Hessian of mu^T r, exact by the implicit function theorem. */

#ifndef SERPENTAIL_STAGE_H
#define SERPENTAIL_STAGE_H

#include "node.h"

/* A result that cannot be had, since FATROP does not take nan for worse than all numbers, and the
   largest derivative that counts as one: with larger ones it looks for a step without end. */
static const double FAR = 1e8, LARGEST = 1e12;

/* A phase's mesh and nodes; arrays are the caller's, and outlive the program. */
typedef struct {
    /* sizes: stages N, intervals I, nodes of an interval K, coefficients of a control in a stage
       C */
    int stages, intervals, nodes, coefficients;
    const int *first;       /* (N + 1) first interval of each stage, and I */
    const double *widths;   /* (I) of the intervals, fractions of the duration */
    const double *fractions;/* (I, K) of the duration, of the nodes */
    const double *basis;    /* (I, K, C) controls at the nodes, of the coefficients */
    const double *states;   /* (K, K + 1) of the rule: states X, times .. = h F */
    const double *weights;  /* (K) of the rule's quadrature */
    const Node *node;
    int bounded;            /* states that have bounds at nodes: how many, and which */
    const int *bounded_states;
} Phase;

/* Memory and results of one stage.  z are the states at its nodes, y what the nodes give there. */
typedef struct {
    const Phase *phase;
    int first, pieces;            /* its intervals: the first of them, and how many */
    int variables, results;       /* sizes of v and r */
    double *v, *z, *y, *r;        /* z (pieces, K, states), y (pieces, K, y), and r, of v */
    double *J;                    /* (pieces, K, y, zeta) of the nodes */
    double *factors;              /* (pieces, K states, K states) of the equations' Jacobians */
    int *pivots;                  /* (pieces, K states) */
    double *slopes;               /* (pieces, K states, variables) dz / dv */
    double *Jr;                   /* (results, variables) dr / dv */
    double *from_v, *from_z;      /* v and z that the slopes are of; z is a guess at first */
    double *scratch;
    int known, failed;            /* whether v is known, and has no z */
    int sloped, factored;         /* whether slopes and factors are there, as of any v */
    double *given;                /* v where the program evaluates it, see all_stages.c */
    double *mu, *H;               /* weights of r, and its Hessian with them */
    int curved;                   /* whether H could be had */
} Stage;

/* lu.c: matrices row by row */
int factorise(int n, double *A, int *pivots); /* 1 where A is singular */
void subtract_rows(int count, const double *factors, const double *A, int stride, double *b,
                   int columns); /* b -= factors A */
void solve(int n, const double *A, const int *pivots, int columns, double *B);
void solve_transposed(int n, const double *A, const int *pivots, double *b);
int is_moderate(const double *values, size_t count); /* whether all are below LARGEST */

/* stage.c */
size_t stage_lay_out(Stage *stage, const Phase *phase, int index, double *memory);
size_t stage_pivots(const Stage *stage);
int stage_values(Stage *stage, const double *v); /* z, y and r of v; 1 where there are none */
int stage_slopes(Stage *stage, const double *v); /* slopes and Jr, too */
int stage_hessian(Stage *stage, const double *v, const double *mu, double *H); /* of mu^T r */

#endif

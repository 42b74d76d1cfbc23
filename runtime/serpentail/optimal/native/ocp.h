/* The whole optimal control problem: stages 0 .. N - 1 in a row, and the end of the motion, number
   N.

   The variables of stage k are its controls u, coefficients, and its states s = (x, constants):
   the state at its start, without x in stage 0 where the start is given, and without the duration
   where that is given.  Constraints: s of the next stage is what a stage leads to; inequalities
   keep controls, states, constants and the nodes' rows within limits; equalities are rows at the
   start, and the goal, rows at the end.

   The goal is elastic: its rows are u of the end, whose squares cost ocp->give / 2 and which are
   small.  FATROP eliminates equalities by the controls of the last stages else, which hardly move
   the attitude: rounding then leaves no step, and it looks for one without end. */

#ifndef SERPENTAIL_OCP_H
#define SERPENTAIL_OCP_H

#include "stage.h"
#include "thread_pool.h"

/* What is asked for, in the program's units; arrays are the caller's, and outlive the program.
   A limit is infinite where there is none. */
typedef struct {
    Phase phase;
    const double *start;      /* (states), or NULL where it is free */
    const double *constants;  /* (constants) those that are given count */
    int free;                 /* the first constants, which are variables: all, or all but the last */
    const double *least_control, *most_control;   /* (controls) */
    const double *least_state, *most_state;       /* (bounded) */
    const double *least_row, *most_row;           /* (rows) of the nodes */
    const double *least_constant, *most_constant; /* (free) */
    const Node *at_start, *at_end;                /* whose rows count; NULL: none */
    int start_equalities;     /* the first rows at the start, which are these values */
    const double *start_values;
    const double *end_values; /* (rows at the end) */
    const double *end_room;   /* (rows at the end) how far each may be off at no cost; 0: see give */
    const double *least_start, *most_start;       /* (the other rows) */
    const int *fixed;         /* (bounded) whether the goal gives a bounded state at the end */
    double give;              /* twice what squares of the goal's rows cost */
    double scale;             /* of the cost */
} Ocp;

typedef struct {
    int controls, states, equalities, inequalities;
} Sizes;

typedef struct {
    const Ocp *ocp;
    Stage *stages;
    double *v, *y, *J, *H, *mu, *scratch; /* of one stage, and of a node at start or end */
    double *still;                        /* controls that are zero */
    double *shift;                        /* of the goal's rows */
    double *rows;                         /* of one stage's slopes */
    int *offsets;                         /* (N + 2) of the stages' variables among all */
    Crew crew;                            /* what evaluates all stages at once */
} Program;

static const double MOST_GIVEN = 0.1;

/* Returns a program, or NULL without memory; the caller frees it. */
Program *program_new(const Ocp *ocp);
void program_free(Program *program);

int program_variables(const Program *program);
int program_rows(const Program *program); /* of constraints, of all stages */
void program_sizes(const Program *program, int *sizes); /* (N + 1, 4) as Sizes */
/* States (I, K, states) at the nodes, where collocation is to begin. */
void program_guess(Program *program, const double *z);
/* Those, where the stages were evaluated last. */
void program_nodes(const Program *program, double *z);

Sizes sizes_of(const Program *program, int k);
/* Limits of which at least one is finite: whether the k-th are, and how many. */
int is_limited(const double *least, const double *most, int k);
int count_limited(const double *least, const double *most, int count);
/* v of stage k < N at the variables w of all stages. */
void variables_of(const Program *program, int k, const double *w, double *v);

/* constraints.c: of stage k at the variables w of all; all stages have to be evaluated there. */
void limits_of(const Program *program, int k, double *least, double *most);
void defects_of(Program *program, int k, const double *w, double *values); /* k < N */
void equalities_of(Program *program, int k, const double *w, double *values);
void inequalities_of(Program *program, int k, const double *w, double *values);
/* Slopes by the stage's own variables, row by row, where the stages have any; of the defects those
   by the next s are minus one.  1 where the end or the start has none. */
void defect_slopes(Program *program, int k, const double *w, double *slopes);
int equality_slopes(Program *program, int k, const double *w, double *slopes);
void inequality_slopes(Program *program, int k, const double *w, double *slopes);
double stages_cost(const Program *program);
double cost_of(const Program *program, const double *w); /* with that of the goal's u */
void cost_slopes(Program *program, int k, const double *w, double *slopes);
/* Multipliers (free) of the constants' limits, of those of stage 0's inequalities. */
void constant_multipliers(const Program *program, const double *lambda, double *found);
/* The Hessian (variables of stage k), of the stage's own part as program_curve has left it, with
   multipliers of the stage's constraints; 1 where there is none. */
int hessian_of(Program *program, int k, const double *w, double scale, const double *equalities,
               const double *inequalities, double *H);

/* all_stages.c: all stages at w, which threads share; a stage keeps what it gives.  The Hessian of
   stage k is that of scale cost + lambda[next[k] ..]^T end + lambda[inner[k] ..]^T inequalities. */
void program_values(Program *program, const double *w);
void program_slopes(Program *program, const double *w);
void program_curve(Program *program, const double *w, double scale, const double *lambda,
                   const int *next, const int *inner);
/* Threads of the host that share this: each calls program_help, which returns when they are
   dismissed.  0 of them, too, where a fork has left them behind. */
void program_helpers(Program *program, int helpers);
void program_help(Program *program);
void program_dismiss(Program *program);

#endif

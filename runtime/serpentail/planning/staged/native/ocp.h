/* The whole program: stages 0 .. N - 1 in a row, and the end of the flight, number N.

   The variables of stage k are its controls u, the torques' coefficients, and its states s = (x,
   T), the state at its start and the flight's duration: without x in stage 0, whose start is
   given, and without T where the duration is given.  Constraints: s of the next stage is what a
   stage leads to; inequalities keep torques, states and the duration within bounds; equalities,
   of the end alone, are the goal.

   The goal is elastic: its rows are u of the end, whose squares cost task->give / 2 and which are
   small.  FATROP eliminates equalities by the controls of the last
   stages else, which hardly move the attitude: rounding then leaves no step, and it looks for one
   without end. */

#ifndef SERPENTAIL_PROGRAM_H
#define SERPENTAIL_PROGRAM_H

#include "thread_pool.h"
#include "stage.h"

typedef struct {
    const Task *task;
    Stage *stages;
    double *H;    /* of a node at the end */
    double *mu;   /* of a node's y */
    double *v;    /* of one stage */
    double *y, *J, *scratch; /* of the node at the end, whose torques are zero */
    double *still;           /* no torques */
    double *shift;           /* of the goal's rows */
    int *offsets;            /* (N + 1) of the stages' variables among all */
    Crew crew;               /* what evaluates all stages at once */
} Program;

static const double MOST_GIVEN = 0.1;

typedef struct {
    int controls, states, equalities, inequalities;
} Sizes;

/* Returns a program, or NULL without memory; the caller frees it. */
Program *program_new(const Task *task);
void program_free(Program *program);

/* Variables, and rows of constraints, of all stages. */
int program_variables(const Program *program);
int program_rows(const Program *program);
/* States (I, K, states) at the nodes, where collocation is to begin. */
void program_guess(Program *program, const double *z);
/* Those, and y (I, K, y), where the stages were evaluated last. */
void program_nodes(const Program *program, double *z, double *y);

Sizes sizes_of(const Program *program, int k);
/* The column of a stage's results' derivatives that belongs to variable c of stage k. */
int column_of(const Program *program, int k, int c);

/* Of stage k < N, given its u and s: the stage evaluated, or NULL where it cannot be. */
Stage *valued(Program *program, int k, const double *u, const double *s);
Stage *sloped(Program *program, int k, const double *u, const double *s);
/* Their v. */
void variables_of(const Program *program, int k, const double *u, const double *s, double *v);

/* all_stages.c: all stages, at u and s of all in a row; what they give is kept, so that the functions
   above give it at once.  The Hessian (all variables of the stage) of stage k is that of scale cost
   + lambda[next[k] ..]^T end + lambda[inner[k] ..]^T inequalities, as those of the stage are. */
void program_values(Program *program, const double *w);
void program_slopes(Program *program, const double *w);
void program_curve(Program *program, const double *w, double scale, const double *lambda,
                   const int *next, const int *inner);
/* Threads of the host that share this: each calls program_help, which returns when they are
   dismissed.  0 of them, too, where a fork has left them behind. */
void program_helpers(Program *program, int helpers);
void program_help(Program *program);
void program_dismiss(Program *program);

/* Limits of inequalities, and these: values, and slopes (inequalities, variables). */
void limits_of(const Program *program, int k, double *least, double *most);
int inequalities_of(Program *program, int k, const double *u, const double *s, double *values);
int inequality_slopes(Program *program, int k, const double *u, const double *s, double *slopes);

/* The goal's equalities: values, slopes (equalities, variables), Hessian (x, x) of lambda^T them. */
int goal_of(Program *program, const double *u, const double *s, double *values, double *slopes);
const double *goal_curved(Program *program, const double *s, const double *lambda);

#endif

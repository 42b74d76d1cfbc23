/* All stages evaluated at once, which threads share: none needs another one's results. */

#include "stage_layout.h"
#include "ocp.h"

/* What is asked of all stages: values (order 0), slopes (1), or Hessians (2) as of program_curve. */
typedef struct {
    Program *program;
    const double *w;
    int order;
    double scale;
    const double *lambda;
    const int *next, *inner;
} Asked;

/* Weights of stage k's results: of its end, of its nodes' rows, of its cost. */
static void write_weights(const Asked *asked, int k)
{
    Stage *stage = asked->program->stages + k;
    const int states = states_of(stage->phase), rows = inner_rows(stage);
    const int before = sizes_of(asked->program, k).inequalities - rows;
    const double *inner = asked->lambda + asked->inner[k] + before;
    memcpy(stage->mu, asked->lambda + asked->next[k], (size_t)states * sizeof *stage->mu);
    memcpy(stage->mu + states, inner, (size_t)rows * sizeof *stage->mu);
    stage->mu[states + rows] = asked->scale * asked->program->ocp->scale;
}

/* A stage keeps what it gives, and whether it fails. */
static void evaluate(void *data, int k)
{
    const Asked *asked = data;
    Stage *stage = asked->program->stages + k;
    variables_of(asked->program, k, asked->w, stage->given);
    if (asked->order == 0) {
        stage_values(stage, stage->given);
    } else if (asked->order == 1) {
        stage_slopes(stage, stage->given);
    } else {
        write_weights(asked, k);
        stage->curved = stage_hessian(stage, stage->given, stage->mu, stage->H) == 0;
    }
}

void program_values(Program *program, const double *w)
{
    Asked asked = {.program = program, .w = w, .order = 0};
    crew_share(&program->crew, program->ocp->phase.stages, evaluate, &asked);
}

void program_slopes(Program *program, const double *w)
{
    Asked asked = {.program = program, .w = w, .order = 1};
    crew_share(&program->crew, program->ocp->phase.stages, evaluate, &asked);
}

void program_curve(Program *program, const double *w, double scale, const double *lambda,
                   const int *next, const int *inner)
{
    Asked asked = {program, w, 2, scale, lambda, next, inner};
    crew_share(&program->crew, program->ocp->phase.stages, evaluate, &asked);
}

/* ---- threads */

void program_help(Program *program)
{
    crew_help(&program->crew);
}

void program_helpers(Program *program, int helpers)
{
    program->crew.helpers = helpers;
}

void program_dismiss(Program *program)
{
    crew_dismiss(&program->crew);
}

/* FATROP, an interior-point method for programs of stages, on ours, through its C interface.

   Its library is CasADi's; what is called of it comes as pointers, so that nothing is linked.  All
   evaluations are of all stages at once: FATROP's own loops over stages are not used. */

#include <math.h>
#include <string.h>

#include "fatrop/ocp/OCPCInterface.h"
#include "ocp.h"

/* What is called of the library. */
typedef struct {
    struct FatropOcpCSolver *(*create)(struct FatropOcpCInterface *, FatropOcpCWrite,
                                       FatropOcpCFlush);
    int (*solve)(struct FatropOcpCSolver *);
    void (*destroy)(struct FatropOcpCSolver *);
    int (*set_double)(struct FatropOcpCSolver *, const char *, double);
    int (*set_int)(struct FatropOcpCSolver *, const char *, int);
    int (*set_bool)(struct FatropOcpCSolver *, const char *, int);
    const struct blasfeo_dvec *(*primal)(struct FatropOcpCSolver *);
    const struct blasfeo_dvec *(*dual)(struct FatropOcpCSolver *);
    const struct FatropOcpCStats *(*stats)(struct FatropOcpCSolver *);
} Library;

/* A setting of FATROP's; kind as its ``option_type`` has it: 0 a double, 1 an int, 2 a bool. */
typedef struct {
    const char *name;
    int kind;
    double value;
} Option;

/* How a solve ended, and what it took. */
typedef struct {
    int status, iterations; /* status as below */
    int flag;               /* FATROP's own */
    double objective;
    double functions_s, total_s; /* wall clock: evaluations, and all */
} Outcome;

enum {
    SOLVED, NOT_SOLVED, STOPPED, BAD_START, NO_DERIVATIVES, NOT_FEASIBLE, CROSSED
};
/* a restoration that lasts longer has been seen to look for a step without end */
enum { MOST_RESTORING = 30 };

typedef struct {
    Program *program;
    const Library *library;
    struct FatropOcpCSolver *solver;
    int (*stop)(void); /* asked at each iteration */
    int ended;         /* the status that ended it early, or 0 */
    int restoring;     /* iterations of the restoration that it is in */
    int inequalities;  /* where those of stage 0 are among the multipliers */
    const double *guess; /* u and s of all stages in a row, at program->offsets */
} Run;

static int stages_of(const Run *run)
{
    return run->program->ocp->phase.stages;
}

/* ---- sizes and starting values */

static int get_nx(int k, void *run)
{
    return sizes_of(((Run *)run)->program, k).states;
}

static int get_nu(int k, void *run)
{
    return sizes_of(((Run *)run)->program, k).controls;
}

static int get_ng(int k, void *run)
{
    return sizes_of(((Run *)run)->program, k).equalities;
}

static int get_ng_ineq(int k, void *run)
{
    return sizes_of(((Run *)run)->program, k).inequalities;
}

static int get_horizon(void *run)
{
    return stages_of(run) + 1;
}

static int get_none_of(int k, void *run)
{
    (void)k;
    (void)run;
    return 0;
}

static int get_none(void *run)
{
    (void)run;
    return 0;
}

static int get_bounds(double *least, double *most, int k, void *run)
{
    limits_of(((Run *)run)->program, k, least, most);
    return 0;
}

static int get_controls(double *u, int k, void *data)
{
    const Run *run = data;
    memcpy(u, run->guess + run->program->offsets[k], (size_t)get_nu(k, data) * sizeof *u);
    return 0;
}

static int get_states(double *s, int k, void *data)
{
    const Run *run = data;
    memcpy(s, run->guess + run->program->offsets[k] + get_nu(k, data),
           (size_t)get_nx(k, data) * sizeof *s);
    return 0;
}

/* ---- evaluations of all stages */

enum { DONE = 1 }; /* nothing is left to FATROP but to subtract the slacks, which 2 forbids, too */

/* The solve ends after this iteration. */
static void end_soon(Run *run, int status)
{
    run->ended = status;
    run->library->set_int(run->solver, "max_iter", 0);
}

static int eval_violations(const double *w, const double *a, const double *b, double *rows,
                           const struct FatropOcpCDims *dims, void *data)
{
    Run *run = data;
    const int N = stages_of(run);
    (void)a;
    (void)b;
    program_values(run->program, w);
    for (int k = 0; k <= N; k++) {
        inequalities_of(run->program, k, w, rows + dims->g_ineq_offs[k]);
        equalities_of(run->program, k, w, rows + dims->g_offs[k]);
        if (k < N) {
            defects_of(run->program, k, w, rows + dims->dyn_eq_offs[k]);
        }
    }
    return DONE;
}

static int eval_objective(double scale, const double *w, const double *a, const double *b,
                          double *value, const struct FatropOcpCDims *dims, void *data)
{
    Run *run = data;
    (void)a;
    (void)b;
    (void)dims;
    program_values(run->program, w);
    *value = scale * cost_of(run->program, w);
    return DONE;
}

/* At a trial point that has no slopes, those that the stage had last serve: FATROP asks for slopes
   there before it turns back. */
static int eval_gradient(double scale, const double *w, const double *a, const double *b,
                         double *gradient, const struct FatropOcpCDims *dims, void *data)
{
    Run *run = data;
    (void)a;
    (void)b;
    program_slopes(run->program, w);
    for (int k = 0; k <= stages_of(run); k++) {
        double *own = gradient + dims->ux_offs[k];
        cost_slopes(run->program, k, w, own);
        for (int c = 0; c < dims->nu[k] + dims->nx[k]; c++) {
            own[c] *= scale;
        }
    }
    return DONE;
}

/* Rows of slopes become columns of FATROP's transposed matrices. */
static void transpose(const double *slopes, int rows, int columns, struct blasfeo_dmat *matrix)
{
    for (int r = 0; r < rows; r++) {
        for (int c = 0; c < columns; c++) {
            BLASFEO_DMATEL(matrix, c, r) = slopes[(size_t)r * columns + c];
        }
    }
}

static int eval_jacobians(const double *w, const double *a, const double *b,
                          struct blasfeo_dmat *dynamics, struct blasfeo_dmat *equalities,
                          struct blasfeo_dmat *inequalities, const struct FatropOcpCDims *dims,
                          void *data)
{
    Run *run = data;
    const int N = stages_of(run);
    double *rows = run->program->rows;
    (void)a;
    (void)b;
    program_slopes(run->program, w);
    for (int k = 0; k <= N; k++) {
        const int columns = dims->nu[k] + dims->nx[k];
        if (k < N) {
            defect_slopes(run->program, k, w, rows);
            transpose(rows, dims->nx[k + 1], columns, dynamics + k);
        }
        inequality_slopes(run->program, k, w, rows);
        transpose(rows, dims->ng_ineq[k], columns, inequalities + k);
        equality_slopes(run->program, k, w, rows);
        transpose(rows, dims->ng[k], columns, equalities + k);
    }
    return DONE;
}

/* The Hessian of stage k, or the identity where there is none or the run is to end: with it FATROP
   finds a last step at once. */
static void write_curvature(Run *run, int k, double scale, const double *w, const double *lambda,
                            struct blasfeo_dmat *matrix, const struct FatropOcpCDims *dims)
{
    const int columns = dims->nu[k] + dims->nx[k];
    double *H = run->program->rows;
    if (hessian_of(run->program, k, w, scale, lambda + dims->g_offs[k],
                   lambda + dims->g_ineq_offs[k], H)
        != 0) {
        end_soon(run, NO_DERIVATIVES);
    }
    for (int r = 0; r < columns; r++) {
        for (int c = 0; c < columns; c++) {
            BLASFEO_DMATEL(matrix, r, c) = run->ended ? r == c : H[(size_t)r * columns + c];
        }
    }
}

static int eval_hessian(double scale, const double *w, const double *lambda, const double *a,
                        const double *b, struct blasfeo_dmat *matrices,
                        const struct FatropOcpCDims *dims, void *data)
{
    Run *run = data;
    const Ocp *ocp = run->program->ocp;
    const int N = stages_of(run);
    (void)a;
    (void)b;
    run->inequalities = dims->g_ineq_offs[0];
    /* where FATROP restores feasibility, the objective does not count */
    run->restoring = scale == 0.0 ? run->restoring + 1 : 0;
    if (run->restoring > MOST_RESTORING) {
        end_soon(run, NOT_FEASIBLE);
    }
    for (int r = 0; scale > 0.0 && r < dims->ng[N]; r++) {
        const double shift = -lambda[dims->g_offs[N] + r] / ocp->give;
        const int ranged = ocp->end_room[r] > 0.0;
        run->program->shift[r] = ranged ? 0.0 : fmax(-MOST_GIVEN, fmin(shift, MOST_GIVEN));
    }
    if (run->stop != NULL && run->stop()) {
        end_soon(run, STOPPED);
    }
    program_curve(run->program, w, scale, lambda, dims->dyn_eq_offs, dims->g_ineq_offs);
    for (int k = 0; k <= N; k++) {
        write_curvature(run, k, scale, w, lambda, matrices + k, dims);
    }
    return DONE;
}

/* ---- settings */

static int get_one_of(int k, void *data)
{
    (void)k;
    (void)data;
    return 1;
}

static int get_two(void *data)
{
    (void)data;
    return 2;
}

/* 0 if FATROP has a setting that is a double.  If not, it ends the process, which must be one of
   its own.  The problem is of two stages, and is not solved. */
int fatrop_takes(const Library *library, const char *setting)
{
    struct FatropOcpCInterface face;
    memset(&face, 0, sizeof face);
    face.get_nx = face.get_nu = get_one_of;
    face.get_ng = face.get_ng_ineq = face.get_n_stage_params = get_none_of;
    face.get_n_global_params = get_none;
    face.get_horizon_length = get_two;
    struct FatropOcpCSolver *solver = library->create(&face, NULL, NULL);
    const int rc = library->set_double(solver, setting, 1.0);
    library->destroy(solver);
    return rc;
}

/* ---- a solve */

static struct FatropOcpCInterface interface_of(Run *run)
{
    struct FatropOcpCInterface face;
    memset(&face, 0, sizeof face);
    face.get_nx = get_nx;
    face.get_nu = get_nu;
    face.get_ng = get_ng;
    face.get_ng_ineq = get_ng_ineq;
    face.get_n_stage_params = get_none_of;
    face.get_n_global_params = get_none;
    face.get_horizon_length = get_horizon;
    face.get_bounds = get_bounds;
    face.get_initial_uk = get_controls;
    face.get_initial_xk = get_states;
    face.full_eval_lag_hess = eval_hessian;
    face.full_eval_constr_jac = eval_jacobians;
    face.full_eval_contr_viol = eval_violations;
    face.full_eval_obj_grad = eval_gradient;
    face.full_eval_obj = eval_objective;
    face.user_data = run;
    return face;
}

static void set_options(const Run *run, const Option *options, int count)
{
    for (int k = 0; k < count; k++) {
        const Option *option = options + k;
        if (option->kind == 0) {
            run->library->set_double(run->solver, option->name, option->value);
        } else if (option->kind == 1) {
            run->library->set_int(run->solver, option->name, (int)option->value);
        } else {
            run->library->set_bool(run->solver, option->name, option->value != 0);
        }
    }
}

/* Whether all stages, and their derivatives, can be had at the guess: FATROP asks in vain else. */
static int starts(Run *run)
{
    Program *program = run->program;
    const int N = stages_of(run);
    program_slopes(program, run->guess);
    for (int k = 0; k < N; k++) {
        if (!program->stages[k].sloped) {
            return 0;
        }
    }
    return equality_slopes(program, 0, run->guess, program->rows) == 0
        && equality_slopes(program, N, run->guess, program->rows) == 0;
}

/* Whether some least limit is not below its largest one. */
static int limits_cross(Run *run)
{
    for (int k = 0; k <= stages_of(run); k++) {
        const int rows = get_ng_ineq(k, run);
        double *least = run->program->rows, *most = least + rows;
        limits_of(run->program, k, least, most);
        for (int r = 0; r < rows; r++) {
            if (!(least[r] < most[r])) {
                return 1;
            }
        }
    }
    return 0;
}

static void finish(Run *run, int rc, double *w, double *slopes, Outcome *outcome)
{
    const struct FatropOcpCStats *stats = run->library->stats(run->solver);
    const struct blasfeo_dvec *primal = run->library->primal(run->solver);
    const struct blasfeo_dvec *dual = run->library->dual(run->solver);
    memcpy(w, primal->pa, (size_t)primal->m * sizeof *w);
    constant_multipliers(run->program, dual->pa + run->inequalities, slopes);
    program_values(run->program, w); /* whose nodes are asked for next */
    outcome->objective = stages_cost(run->program);
    outcome->status = rc == 0 ? SOLVED : run->ended ? run->ended : NOT_SOLVED;
    outcome->iterations = stats->iterations_count;
    outcome->flag = stats->return_flag;
    outcome->total_s = stats->time_total;
    outcome->functions_s = stats->eval_hess_time + stats->eval_jac_time + stats->eval_cv_time
                         + stats->eval_grad_time + stats->eval_obj_time;
}

/* Solve from w, u and s of all stages in a row, which becomes the solution; slopes (free):
   multipliers of the constants' limits. */
void fatrop_run(Program *program, const Library *library, const Option *options, int count,
                int (*stop)(void), double *w, double *slopes, Outcome *outcome)
{
    Run run = {.program = program, .library = library, .stop = stop, .guess = w};
    struct FatropOcpCInterface face = interface_of(&run);
    memset(outcome, 0, sizeof *outcome);
    outcome->status = limits_cross(&run) ? CROSSED : BAD_START;
    if (outcome->status == BAD_START && starts(&run)) {
        run.solver = library->create(&face, NULL, NULL);
        set_options(&run, options, count);
        const int rc = library->solve(run.solver);
        finish(&run, rc, w, slopes, outcome);
        library->destroy(run.solver);
    }
}

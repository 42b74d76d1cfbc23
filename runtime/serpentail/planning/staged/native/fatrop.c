/* FATROP, an interior-point method for programs of stages, on ours, through its C interface.

   Its library is CasADi's; what is called of it comes as pointers, so that nothing is linked.  All
   evaluations are of all stages at once: FATROP's own loops over stages are not used. */

#include <math.h>
#include <stdlib.h>
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
    SOLVED, NOT_SOLVED, STOPPED, BAD_START, NO_DERIVATIVES, NOT_FEASIBLE, NO_MEMORY, CROSSED
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
    const double *guess; /* u and s of all stages in a row, at program->offsets */
    double *values;      /* of one stage's constraints, and their slopes */
    double *slopes;
} Run;

static int stages_of(const Run *run)
{
    return run->program->task->stages;
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

static const double *controls_of(const double *w, const struct FatropOcpCDims *dims, int k)
{
    return w + dims->ux_offs[k];
}

static const double *states_at(const double *w, const struct FatropOcpCDims *dims, int k)
{
    return w + dims->ux_offs[k] + dims->nu[k];
}

static double duration_at(const Run *run, const double *w, const struct FatropOcpCDims *dims)
{
    return dims->nx[0] > 0 ? w[dims->ux_offs[0] + dims->nu[0]] : run->program->task->longest;
}

/* The solve ends after this iteration. */
static void end_soon(Run *run, int status)
{
    run->ended = status;
    run->library->set_int(run->solver, "max_iter", 0);
}

/* What stage k leads to, less the next stage's s. */
static void write_defects(Run *run, int k, const double *w, const struct FatropOcpCDims *dims,
                          double *defects)
{
    const double *s = states_at(w, dims, k), *next = states_at(w, dims, k + 1);
    const int states = ATTITUDE + 2 * run->program->task->tail;
    const Stage *stage = valued(run->program, k, controls_of(w, dims, k), s);
    for (int a = 0; a < states; a++) {
        defects[a] = stage == NULL ? FAR : stage->r[a] - next[a];
    }
    if (dims->nx[k + 1] > states) {
        defects[states] = s[dims->nx[k] - 1] - next[states];
    }
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
        inequalities_of(run->program, k, controls_of(w, dims, k), states_at(w, dims, k),
                        rows + dims->g_ineq_offs[k]);
        if (k < N) {
            write_defects(run, k, w, dims, rows + dims->dyn_eq_offs[k]);
        }
    }
    goal_of(run->program, controls_of(w, dims, N), states_at(w, dims, N), rows + dims->g_offs[N],
            run->slopes);
    return DONE;
}

static int eval_objective(double scale, const double *w, const double *a, const double *b,
                          double *value, const struct FatropOcpCDims *dims, void *data)
{
    Run *run = data;
    const Task *task = run->program->task;
    double sum = 0.0;
    (void)a;
    (void)b;
    program_values(run->program, w);
    for (int k = 0; k < task->stages; k++) {
        const Stage *stage = valued(run->program, k, controls_of(w, dims, k),
                                    states_at(w, dims, k));
        sum += stage == NULL ? FAR : stage->r[stage->results - 1];
    }
    for (int c = 0; c < dims->nu[task->stages]; c++) {
        const double give = controls_of(w, dims, task->stages)[c];
        sum += task->give / 2 * give * give;
    }
    *value = scale * (sum + task->price * duration_at(run, w, dims));
    return DONE;
}

/* Stage k with its slopes, where there are none with those that it had last: FATROP would look for
   a step without end that derivatives that are no numbers, or zero, do not have. */
static const Stage *sloped_or_last(Run *run, int k, const double *w,
                                   const struct FatropOcpCDims *dims)
{
    if (sloped(run->program, k, controls_of(w, dims, k), states_at(w, dims, k)) == NULL) {
        end_soon(run, NO_DERIVATIVES);
    }
    return run->program->stages + k;
}

static double cost_slope(const Stage *stage, int column)
{
    return stage->Jr[(size_t)(stage->results - 1) * stage->variables + column];
}

static int eval_gradient(double scale, const double *w, const double *a, const double *b,
                         double *gradient, const struct FatropOcpCDims *dims, void *data)
{
    Run *run = data;
    const Task *task = run->program->task;
    const int N = task->stages;
    (void)a;
    (void)b;
    program_slopes(run->program, w);
    for (int k = 0; k < N; k++) {
        double *own = gradient + dims->ux_offs[k];
        const Stage *stage = sloped_or_last(run, k, w, dims);
        for (int c = 0; c < dims->nu[k] + dims->nx[k]; c++) {
            own[c] = scale * cost_slope(stage, column_of(run->program, k, c));
        }
    }
    double *end = gradient + dims->ux_offs[N];
    memset(end, 0, (size_t)(dims->nu[N] + dims->nx[N]) * sizeof *end);
    for (int c = 0; c < dims->nu[N]; c++) {
        end[c] = scale * task->give * controls_of(w, dims, N)[c];
    }
    if (dims->nx[0] > 0) { /* the duration is a variable */
        gradient[dims->ux_offs[0] + dims->nu[0]] += scale * task->price;
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

static void write_dynamics(Run *run, int k, const double *w, const struct FatropOcpCDims *dims,
                           struct blasfeo_dmat *matrix)
{
    const int states = ATTITUDE + 2 * run->program->task->tail;
    const int columns = dims->nu[k] + dims->nx[k], rows = dims->nx[k + 1];
    const Stage *stage = sloped_or_last(run, k, w, dims);
    for (int r = 0; r < rows; r++) {
        for (int c = 0; c < columns; c++) {
            double slope = r == states && c == columns - 1; /* the duration stays */
            if (r < states) {
                slope = stage->Jr[(size_t)r * stage->variables + column_of(run->program, k, c)];
            }
            BLASFEO_DMATEL(matrix, c, r) = slope;
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
    (void)a;
    (void)b;
    program_slopes(run->program, w);
    for (int k = 0; k <= N; k++) {
        const double *s = states_at(w, dims, k);
        if (k < N) {
            write_dynamics(run, k, w, dims, dynamics + k);
        }
        inequality_slopes(run->program, k, controls_of(w, dims, k), s, run->slopes);
        transpose(run->slopes, dims->ng_ineq[k], dims->nu[k] + dims->nx[k], inequalities + k);
    }
    goal_of(run->program, controls_of(w, dims, N), states_at(w, dims, N), run->values,
            run->slopes);
    transpose(run->slopes, dims->ng[N], dims->nu[N] + dims->nx[N], equalities + N);
    return DONE;
}

/* The Hessian of stage k, or the identity where there is none or the run is to end: with it FATROP
   finds a last step at once. */
static void write_curvature(Run *run, int k, struct blasfeo_dmat *matrix,
                            const struct FatropOcpCDims *dims)
{
    const Stage *stage = run->program->stages + k;
    const int columns = dims->nu[k] + dims->nx[k], n = stage->variables;
    if (!stage->curved) {
        end_soon(run, NO_DERIVATIVES);
    }
    for (int r = 0; r < columns; r++) {
        for (int c = 0; c < columns; c++) {
            BLASFEO_DMATEL(matrix, r, c)
                = run->ended ? r == c
                             : stage->H[(size_t)column_of(run->program, k, r) * n
                                        + column_of(run->program, k, c)];
        }
    }
}

/* The Hessian of what the goal's rows cost, and of lambda^T them. */
static void write_end(Run *run, double scale, const double *w, const double *lambda,
                      struct blasfeo_dmat *matrix, const struct FatropOcpCDims *dims)
{
    const Task *task = run->program->task;
    const int N = task->stages, states = ATTITUDE + 2 * task->tail, zeta = states + task->tail;
    const int rows = dims->nu[N];
    const double *H = goal_curved(run->program, states_at(w, dims, N), lambda + dims->g_offs[N]);
    for (int r = 0; r < rows + dims->nx[N]; r++) {
        for (int c = 0; c < rows + dims->nx[N]; c++) {
            const int inside = H != NULL && !run->ended && r >= rows && c >= rows && r < rows + states
                            && c < rows + states;
            BLASFEO_DMATEL(matrix, r, c)
                = inside ? H[(size_t)(r - rows) * zeta + c - rows]
                         : (r == c && r < rows ? scale * task->give : 0.0);
        }
    }
}

static int eval_hessian(double scale, const double *w, const double *lambda, const double *a,
                        const double *b, struct blasfeo_dmat *matrices,
                        const struct FatropOcpCDims *dims, void *data)
{
    Run *run = data;
    const Task *task = run->program->task;
    const int N = task->stages;
    (void)a;
    (void)b;
    /* where FATROP restores feasibility, the objective does not count */
    run->restoring = scale == 0.0 ? run->restoring + 1 : 0;
    if (run->restoring > MOST_RESTORING) {
        end_soon(run, NOT_FEASIBLE);
    }
    for (int r = 0; scale > 0.0 && r < dims->ng[N]; r++) {
        const double shift = -lambda[dims->g_offs[N] + r] / task->give;
        run->program->shift[r] = fmax(-MOST_GIVEN, fmin(shift, MOST_GIVEN));
    }
    if (run->stop != NULL && run->stop()) {
        end_soon(run, STOPPED);
    }
    program_curve(run->program, w, scale, lambda, dims->dyn_eq_offs, dims->g_ineq_offs);
    for (int k = 0; k < N; k++) {
        write_curvature(run, k, matrices + k, dims);
    }
    write_end(run, scale, w, lambda, matrices + N, dims);
    return DONE;
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
    const int N = stages_of(run);
    program_slopes(run->program, run->guess);
    for (int k = 0; k < N; k++) {
        const double *u = run->guess + run->program->offsets[k];
        if (sloped(run->program, k, u, u + get_nu(k, run)) == NULL) {
            return 0;
        }
    }
    const double *u = run->guess + run->program->offsets[N];
    return goal_of(run->program, u, u + get_nu(N, run), run->values, run->slopes) == 0;
}

/* Whether some least limit is not below its largest one. */
static int limits_cross(Run *run)
{
    for (int k = 0; k <= stages_of(run); k++) {
        const int rows = get_ng_ineq(k, run);
        double *least = run->slopes, *most = run->slopes + rows;
        limits_of(run->program, k, least, most);
        for (int r = 0; r < rows; r++) {
            if (!(least[r] < most[r])) {
                return 1;
            }
        }
    }
    return 0;
}

static size_t most_slopes(const Run *run)
{
    size_t most = 1;
    for (int k = 0; k <= stages_of(run); k++) {
        const Sizes sizes = sizes_of(run->program, k);
        const size_t own = (size_t)(sizes.equalities + sizes.inequalities)
                         * (size_t)(sizes.controls + sizes.states + 1);
        most = own > most ? own : most;
    }
    return most;
}

/* All stages at the solution, whose nodes are asked for next, and its objective. */
static void eval_solution(Run *run, const double *w, Outcome *outcome)
{
    const Task *task = run->program->task;
    const int last = get_nu(0, run), size = get_nx(0, run);
    outcome->objective = task->price * (size > 0 ? w[last] : task->longest);
    program_values(run->program, w);
    for (int k = 0; k < task->stages; k++) {
        const double *u = w + run->program->offsets[k];
        const Stage *stage = valued(run->program, k, u, u + get_nu(k, run));
        outcome->objective += stage == NULL ? NAN : stage->r[stage->results - 1];
    }
}

static void finish(Run *run, int rc, double *w, double *lambda, Outcome *outcome)
{
    const struct FatropOcpCStats *stats = run->library->stats(run->solver);
    const struct blasfeo_dvec *primal = run->library->primal(run->solver);
    const struct blasfeo_dvec *dual = run->library->dual(run->solver);
    memcpy(w, primal->pa, (size_t)primal->m * sizeof *w);
    memcpy(lambda, dual->pa, (size_t)dual->m * sizeof *lambda);
    eval_solution(run, w, outcome);
    outcome->status = rc == 0 ? SOLVED : run->ended ? run->ended : NOT_SOLVED;
    outcome->iterations = stats->iterations_count;
    outcome->flag = stats->return_flag;
    outcome->total_s = stats->time_total;
    outcome->functions_s = stats->eval_hess_time + stats->eval_jac_time + stats->eval_cv_time
                         + stats->eval_grad_time + stats->eval_obj_time;
}

/* Solve from w, u and s of all stages in a row, which becomes the solution; lambda: multipliers of
   all constraints, as FATROP orders them. */
void fatrop_run(Program *program, const Library *library, const Option *options, int count,
                int (*stop)(void), double *w, double *lambda, Outcome *outcome)
{
    Run run = {.program = program, .library = library, .stop = stop, .guess = w};
    struct FatropOcpCInterface face = interface_of(&run);
    memset(outcome, 0, sizeof *outcome);
    outcome->status = NO_MEMORY;
    run.slopes = malloc(2 * most_slopes(&run) * sizeof *run.slopes);
    if (run.slopes == NULL) {
        return;
    }
    run.values = run.slopes + most_slopes(&run);
    outcome->status = limits_cross(&run) ? CROSSED : BAD_START;
    if (outcome->status == BAD_START && starts(&run)) {
        run.solver = library->create(&face, NULL, NULL);
        set_options(&run, options, count);
        const int rc = library->solve(run.solver);
        finish(&run, rc, w, lambda, outcome);
        library->destroy(run.solver);
    }
    free(run.slopes);
}

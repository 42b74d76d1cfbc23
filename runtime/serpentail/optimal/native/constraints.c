/* Constraints and cost of the whole program, stage by stage, and their slopes. */

#include <math.h>

#include "stage_layout.h"
#include "ocp.h"

/* ---- where a stage's variables are */

static const double *controls_of(const Program *program, int k, const double *w)
{
    return w + program->offsets[k];
}

static const double *states_at(const Program *program, int k, const double *w)
{
    return w + program->offsets[k] + sizes_of(program, k).controls;
}

static int columns_of(const Program *program, int k)
{
    return program->offsets[k + 1] - program->offsets[k];
}

/* Whether s of a stage begins with the state x. */
static int has_x(const Program *program, int k)
{
    return k > 0 || program->ocp->start == NULL;
}

/* The column of a stage's v that its variable c is. */
static int column_of(const Program *program, int k, int c)
{
    const Phase *phase = &program->ocp->phase;
    return !has_x(program, k) && c >= coefficients_of(phase) ? c + states_of(phase) : c;
}

/* x and constants at the start of stage k, or at the end. */
static const double *state_of(const Program *program, int k, const double *w)
{
    return has_x(program, k) ? states_at(program, k, w) : program->ocp->start;
}

static void write_constants(const Program *program, int k, const double *w, double *p)
{
    const Ocp *ocp = program->ocp;
    const double *s = states_at(program, k, w);
    const int skip = has_x(program, k) ? states_of(&ocp->phase) : 0;
    memcpy(p, ocp->constants, (size_t)ocp->phase.node->constants * sizeof *p);
    memcpy(p, s + skip, (size_t)ocp->free * sizeof *p);
}

void variables_of(const Program *program, int k, const double *w, double *v)
{
    const Phase *phase = &program->ocp->phase;
    const int controls = coefficients_of(phase), states = states_of(phase);
    memcpy(v, controls_of(program, k, w), (size_t)controls * sizeof *v);
    memcpy(v + controls, state_of(program, k, w), (size_t)states * sizeof *v);
    write_constants(program, k, w, v + controls + states);
}

/* ---- rows at the start and at the end */

/* The node there, evaluated with controls that are zero. */
static int at_boundary(Program *program, const Node *node, int k, const double *w,
                       const double *mu, int slopes)
{
    double *p = program->v, *J = slopes || mu != NULL ? program->J : NULL;
    write_constants(program, k, w, p);
    return node_evaluate(node, state_of(program, k, w), program->still, p,
                         k == 0 ? 0.0 : 1.0, mu, program->y, J, mu == NULL ? NULL : program->H,
                         program->scratch);
}

/* Rows first .. of such a node become values, far from zero where there are none. */
static void boundary_values(Program *program, const Node *node, int k, const double *w, int first,
                            int count, double *values)
{
    const int failed = count > 0 && at_boundary(program, node, k, w, NULL, 0);
    for (int r = 0; r < count; r++) {
        values[r] = failed ? FAR : program->y[node->states + first + r];
    }
}

/* The slopes of its rows first .. by (x, p) go to columns of s. */
static int boundary_slopes(Program *program, const Node *node, int k, const double *w, int first,
                           int count, double *slopes)
{
    if (count == 0 || at_boundary(program, node, k, w, NULL, 1) != 0) {
        return count > 0;
    }
    const int columns = columns_of(program, k), states = node->states, zeta = zeta_of(node);
    const int own = sizes_of(program, k).controls, skip = node->states + node->controls;
    for (int r = 0; r < count; r++) {
        const double *J = program->J + (size_t)(states + first + r) * zeta;
        double *row = slopes + (size_t)r * columns + own;
        if (has_x(program, k)) {
            memcpy(row, J, (size_t)states * sizeof *row);
            row += states;
        }
        memcpy(row, J + skip, (size_t)program->ocp->free * sizeof *row);
    }
    return 0;
}

/* ---- the stages follow each other */

void defects_of(Program *program, int k, const double *w, double *values)
{
    const Stage *stage = program->stages + k;
    const int states = states_of(stage->phase), free = program->ocp->free;
    const double *next = states_at(program, k + 1, w);
    const double *constants = states_at(program, k, w) + (has_x(program, k) ? states : 0);
    for (int a = 0; a < states; a++) {
        values[a] = stage->failed ? FAR : stage->r[a] - next[a];
    }
    for (int c = 0; c < free; c++) {
        values[states + c] = constants[c] - next[states + c];
    }
}

static void own_row(const Program *program, int k, const double *Jr, double *row)
{
    for (int c = 0; c < columns_of(program, k); c++) {
        row[c] = Jr[column_of(program, k, c)];
    }
}

void defect_slopes(Program *program, int k, const double *w, double *slopes)
{
    const Stage *stage = program->stages + k;
    const int states = states_of(stage->phase), columns = columns_of(program, k);
    const int first = columns - program->ocp->free;
    (void)w;
    for (int a = 0; a < states; a++) {
        own_row(program, k, stage->Jr + (size_t)a * stage->variables, slopes + (size_t)a * columns);
    }
    for (int c = 0; c < program->ocp->free; c++) {
        double *row = slopes + (size_t)(states + c) * columns;
        memset(row, 0, (size_t)columns * sizeof *row);
        row[first + c] = 1.0;
    }
}

/* ---- equalities: at the start, and the goal's */

void equalities_of(Program *program, int k, const double *w, double *values)
{
    const Ocp *ocp = program->ocp;
    const int N = ocp->phase.stages, count = sizes_of(program, k).equalities;
    const Node *node = k == N ? ocp->at_end : ocp->at_start;
    const double *targets = k == N ? ocp->end_values : ocp->start_values;
    boundary_values(program, node, k, w, 0, count, values);
    for (int r = 0; r < count; r++) {
        values[r] -= targets[r];
        if (k == N) {
            values[r] -= controls_of(program, N, w)[r] + program->shift[r];
        }
    }
}

int equality_slopes(Program *program, int k, const double *w, double *slopes)
{
    const Ocp *ocp = program->ocp;
    const int N = ocp->phase.stages, count = sizes_of(program, k).equalities;
    const int columns = columns_of(program, k);
    const Node *node = k == N ? ocp->at_end : ocp->at_start;
    memset(slopes, 0, (size_t)count * columns * sizeof *slopes);
    for (int r = 0; k == N && r < count; r++) {
        slopes[(size_t)r * columns + r] = -1.0;
    }
    return boundary_slopes(program, node, k, w, 0, count, slopes);
}

/* ---- inequalities: of controls, the state, constants, rows at the start, nodes, the goal's u */

static int limit(double *least, double *most, int row, double low, double high)
{
    least[row] = low;
    most[row] = high;
    return row + 1;
}

void limits_of(const Program *program, int k, double *least, double *most)
{
    const Ocp *ocp = program->ocp;
    const Phase *phase = &ocp->phase;
    const int N = phase->stages, controls = phase->node->controls;
    int row = 0;
    for (int c = 0; k < N && c < coefficients_of(phase); c++) {
        if (is_limited(ocp->least_control, ocp->most_control, c % controls)) {
            row = limit(least, most, row, ocp->least_control[c % controls],
                        ocp->most_control[c % controls]);
        }
    }
    for (int b = 0; has_x(program, k) && b < phase->bounded; b++) {
        if (k < N || !ocp->fixed[b]) {
            row = limit(least, most, row, ocp->least_state[b], ocp->most_state[b]);
        }
    }
    if (k == N) {
        for (int c = 0; c < sizes_of(program, N).controls; c++) {
            const double room = ocp->end_room[c] > 0.0 ? ocp->end_room[c] : MOST_GIVEN;
            row = limit(least, most, row, -room, room);
        }
        return;
    }
    for (int c = 0; k == 0 && c < ocp->free; c++) {
        if (is_limited(ocp->least_constant, ocp->most_constant, c)) {
            row = limit(least, most, row, ocp->least_constant[c], ocp->most_constant[c]);
        }
    }
    const int at_start = ocp->at_start == NULL ? 0 : ocp->at_start->rows;
    for (int r = 0; k == 0 && r < at_start - ocp->start_equalities; r++) {
        row = limit(least, most, row, ocp->least_start[r], ocp->most_start[r]);
    }
    const Stage *stage = program->stages + k;
    for (int node = 0; node < node_count(stage); node++) {
        for (int b = 0; node + 1 < node_count(stage) && b < phase->bounded; b++) {
            row = limit(least, most, row, ocp->least_state[b], ocp->most_state[b]);
        }
        for (int r = 0; r < phase->node->rows; r++) {
            row = limit(least, most, row, ocp->least_row[r], ocp->most_row[r]);
        }
    }
}

void constant_multipliers(const Program *program, const double *lambda, double *found)
{
    const Ocp *ocp = program->ocp;
    const Phase *phase = &ocp->phase;
    int row = phase->coefficients
                * count_limited(ocp->least_control, ocp->most_control, phase->node->controls)
            + (has_x(program, 0) ? phase->bounded : 0);
    for (int c = 0; c < ocp->free; c++) {
        const int limited = is_limited(ocp->least_constant, ocp->most_constant, c);
        found[c] = limited ? lambda[row] : 0.0;
        row += limited;
    }
}

/* Values, or slopes where these are not NULL: both go through the rows in the same order. */
static int variable_row(const Program *program, int k, int column, double value, double *values,
                        double *slopes, int row)
{
    if (slopes != NULL) {
        slopes[(size_t)row * columns_of(program, k) + column] = 1.0;
    } else {
        values[row] = value;
    }
    return row + 1;
}

static void write_inequalities(Program *program, int k, const double *w, double *values,
                               double *slopes)
{
    const Ocp *ocp = program->ocp;
    const Phase *phase = &ocp->phase;
    const int N = phase->stages, controls = phase->node->controls, columns = columns_of(program, k);
    const int own = sizes_of(program, k).controls, x = has_x(program, k) ? states_of(phase) : 0;
    const double *variables = controls_of(program, k, w);
    int row = 0;
    for (int c = 0; k < N && c < own; c++) {
        if (is_limited(ocp->least_control, ocp->most_control, c % controls)) {
            row = variable_row(program, k, c, variables[c], values, slopes, row);
        }
    }
    for (int b = 0; has_x(program, k) && b < phase->bounded; b++) {
        if (k < N || !ocp->fixed[b]) {
            const int column = own + phase->bounded_states[b];
            row = variable_row(program, k, column, variables[column], values, slopes, row);
        }
    }
    for (int c = 0; k == N && c < own; c++) {
        row = variable_row(program, k, c, variables[c], values, slopes, row);
    }
    for (int c = 0; k == 0 && c < ocp->free; c++) {
        if (is_limited(ocp->least_constant, ocp->most_constant, c)) {
            row = variable_row(program, k, own + x + c, variables[own + x + c], values, slopes,
                               row);
        }
    }
    if (k == 0 && ocp->at_start != NULL) {
        const int first = ocp->start_equalities, count = ocp->at_start->rows - first;
        if (slopes != NULL) {
            boundary_slopes(program, ocp->at_start, 0, w, first, count,
                            slopes + (size_t)row * columns);
        } else {
            boundary_values(program, ocp->at_start, 0, w, first, count, values + row);
        }
        row += count;
    }
    if (k == N) {
        return;
    }
    const Stage *stage = program->stages + k;
    for (int r = states_of(phase); r + 1 < stage->results; r++, row++) {
        if (slopes != NULL) {
            own_row(program, k, stage->Jr + (size_t)r * stage->variables,
                    slopes + (size_t)row * columns);
        } else {
            values[row] = stage->r[r]; /* far from any limit where the stage fails */
        }
    }
}

void inequalities_of(Program *program, int k, const double *w, double *values)
{
    write_inequalities(program, k, w, values, NULL);
}

void inequality_slopes(Program *program, int k, const double *w, double *slopes)
{
    memset(slopes, 0, (size_t)sizes_of(program, k).inequalities * columns_of(program, k)
                          * sizeof *slopes);
    write_inequalities(program, k, w, NULL, slopes);
}

/* ---- cost */

double stages_cost(const Program *program)
{
    double sum = 0.0;
    for (int k = 0; k < program->ocp->phase.stages; k++) {
        const Stage *stage = program->stages + k;
        sum += stage->failed ? FAR : program->ocp->scale * stage->r[stage->results - 1];
    }
    return sum;
}

/* Twice what the square of a row of the goal costs. */
static double give_of(const Ocp *ocp, int row)
{
    return ocp->end_room[row] > 0.0 ? 0.0 : ocp->give;
}

double cost_of(const Program *program, const double *w)
{
    const Ocp *ocp = program->ocp;
    const int N = ocp->phase.stages;
    double sum = stages_cost(program);
    for (int c = 0; c < sizes_of(program, N).controls; c++) {
        const double give = controls_of(program, N, w)[c];
        sum += give_of(ocp, c) / 2 * give * give;
    }
    return sum;
}

void cost_slopes(Program *program, int k, const double *w, double *slopes)
{
    const Ocp *ocp = program->ocp;
    const int N = ocp->phase.stages, columns = columns_of(program, k);
    if (k < N) {
        const Stage *stage = program->stages + k;
        own_row(program, k, stage->Jr + (size_t)(stage->results - 1) * stage->variables, slopes);
        for (int c = 0; c < columns; c++) {
            slopes[c] *= ocp->scale;
        }
        return;
    }
    memset(slopes, 0, (size_t)columns * sizeof *slopes);
    for (int c = 0; c < sizes_of(program, N).controls; c++) {
        slopes[c] = give_of(ocp, c) * controls_of(program, N, w)[c];
    }
}

/* ---- Hessians */

/* H of stage k += that of mu^T rows of a node at the start or the end, of (x, p). */
static int add_boundary(Program *program, const Node *node, int k, const double *w, double *H)
{
    const int states = node->states, zeta = zeta_of(node), skip = states + node->controls;
    const int columns = columns_of(program, k), own = sizes_of(program, k).controls;
    const int x = has_x(program, k) ? states : 0, size = x + program->ocp->free;
    if (at_boundary(program, node, k, w, program->mu, 1) != 0) {
        return 1;
    }
    for (int i = 0; i < size; i++) {
        for (int j = 0; j < size; j++) {
            const int a = i < x ? i : i - x + skip, b = j < x ? j : j - x + skip;
            H[(size_t)(own + i) * columns + own + j] += program->H[(size_t)a * zeta + b];
        }
    }
    return !is_moderate(program->H, (size_t)zeta * zeta);
}

/* Weights of a node's rows: of those that are equalities, and of the others. */
static void weigh_rows(Program *program, const Node *node, int equalities, const double *lambda,
                       const double *others)
{
    double *mu = program->mu;
    memset(mu, 0, (size_t)y_of_node(node) * sizeof *mu);
    memcpy(mu + node->states, lambda, (size_t)equalities * sizeof *mu);
    memcpy(mu + node->states + equalities, others,
           (size_t)(node->rows - equalities) * sizeof *mu);
}

int hessian_of(Program *program, int k, const double *w, double scale, const double *equalities,
               const double *inequalities, double *H)
{
    const Ocp *ocp = program->ocp;
    const int N = ocp->phase.stages, columns = columns_of(program, k);
    const Sizes sizes = sizes_of(program, k);
    if (k == N) {
        memset(H, 0, (size_t)columns * columns * sizeof *H);
        for (int c = 0; c < sizes.controls; c++) {
            H[(size_t)c * columns + c] = scale * give_of(ocp, c);
        }
        if (ocp->at_end == NULL) {
            return 0;
        }
        weigh_rows(program, ocp->at_end, ocp->at_end->rows, equalities, inequalities);
        return add_boundary(program, ocp->at_end, N, w, H);
    }
    const Stage *stage = program->stages + k;
    for (int r = 0; r < columns; r++) {
        own_row(program, k, stage->H + (size_t)column_of(program, k, r) * stage->variables,
                H + (size_t)r * columns);
    }
    if (!stage->curved || k > 0 || ocp->at_start == NULL) {
        return !stage->curved;
    }
    const int ranges = ocp->at_start->rows - sizes.equalities;
    weigh_rows(program, ocp->at_start, sizes.equalities, equalities,
               inequalities + sizes.inequalities - inner_rows(stage) - ranges);
    return add_boundary(program, ocp->at_start, 0, w, H);
}

/* A node in the program's units: emitted rates with the joints' damping, and terms chained to
   them. */

#include <math.h>
#include <string.h>

#include "node.h"

/* Sizes, and where in the scratch is what. */
typedef struct {
    int zeta, y, e, terms; /* of (x, omega, u, p), of terms */
    int air, air_y, raw; /* of airborne zeta and y; of zeta with torques, not inputs */
    double *z, *tau, *air_out, *air_J, *air_H, *air_mu, *e_in, *out, *out_J, *out_H, *out_mu, *work;
    double *raw_J, *raw_H, *half, *driven, *driven_J, *driven_mu;
} Places;

/* Length of the airborne state, with which x begins. */
static int airborne_of(const Node *node)
{
    return ATTITUDE + 2 * node->tail + node->drift;
}

static Places places_of(const Node *node, double *scratch)
{
    Places at = {0};
    const int m = node->tail;
    at.zeta = zeta_of(node);
    at.y = y_of_node(node);
    at.raw = m > 0 ? airborne_of(node) + m : 0;
    at.air = node->inputs > 0 ? airborne_of(node) + node->inputs : at.raw;
    at.air_y = m > 0 ? airborne_of(node) + TURN : 0;
    at.e = at.zeta + (m > 0 ? TURN : 0);
    at.terms = (m > 0 ? 0 : node->states) + node->rows + 1;
    at.z = scratch;
    at.tau = at.z + at.zeta;
    at.air_out = at.tau + m;
    at.air_mu = at.air_out + at.air_y;
    at.air_J = at.air_mu + at.air_y;
    at.air_H = at.air_J + (size_t)at.air_y * at.air;
    at.e_in = at.air_H + (size_t)at.air * at.air;
    at.out = at.e_in + at.e + 1 + node->given;
    at.out_mu = at.out + at.terms;
    at.out_J = at.out_mu + at.terms;
    at.out_H = at.out_J + (size_t)at.terms * at.e;
    at.work = at.out_H + (size_t)at.e * at.e;
    at.raw_J = at.air_J;
    at.raw_H = at.air_H;
    if (node->inputs > 0) {
        at.driven = at.work;
        at.driven_mu = at.driven + at.raw;
        at.driven_J = at.driven_mu + at.raw;
        at.half = at.driven_J + (size_t)at.raw * at.air;
        at.raw_J = at.half + (size_t)at.raw * at.air;
        at.raw_H = at.raw_J + (size_t)at.air_y * at.raw;
        at.work = at.raw_H + (size_t)at.raw * at.raw;
    }
    return at;
}

size_t node_scratch(const Node *node)
{
    const Places at = places_of(node, NULL);
    return (size_t)(at.work - at.z) + (size_t)node->work;
}

static int finite(const double *values, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        if (!isfinite(values[k])) {
            return 0;
        }
    }
    return 1;
}

/* (x, torques) of (x, inputs), 0 where all is finite; order 2: weighed by driven_mu, to air_H. */
static int evaluate_drive(const Node *node, Places at, int order)
{
    const double *arg[8] = {at.z, at.driven_mu};
    double *res[8] = {at.driven, at.driven_J, at.air_H};
    return (order == 2 ? node->drive_twice : order == 1 ? node->drive_slopes : node->drive)(
               arg, res, NULL, NULL, 0)
        || !finite(at.driven, (size_t)at.raw);
}

/* zeta in SI; the torques in truth are tau - damping q_t_dot, in tau. */
static int in_si(const Node *node, Places at, const double *x, const double *u, const double *p,
                 int slopes)
{
    double *z = at.z, *tau = at.tau;
    const int states = node->states, controls = node->controls, m = node->tail;
    for (int j = 0; j < states; j++) {
        z[j] = node->units[j] * x[j];
    }
    for (int j = 0; j < controls; j++) {
        z[states + j] = node->units[states + j] * u[j];
    }
    for (int j = 0; j < node->constants; j++) {
        z[states + controls + j] = node->units[states + controls + j] * p[j];
    }
    if (node->inputs > 0 && evaluate_drive(node, at, slopes) != 0) {
        return 1;
    }
    const double *given = (node->inputs > 0 ? at.driven : z) + airborne_of(node);
    for (int a = 0; a < m; a++) {
        tau[a] = given[a] - node->damping * z[ATTITUDE + m + a];
    }
    return 0;
}

/* The place of entry j of zeta in e. */
static int in_e(const Node *node, int j)
{
    return node->tail > 0 && j >= node->states ? j + TURN : j;
}

static int evaluate_terms(const Node *node, Places at, double fraction, int order)
{
    const double *arg[8] = {at.e_in, at.out_mu};
    double *res[8] = {at.out, at.out_J, at.out_H};
    for (int j = 0; j < at.zeta; j++) {
        at.e_in[in_e(node, j)] = at.z[j];
    }
    if (node->tail > 0) {
        memcpy(at.e_in + node->states, at.air_out + airborne_of(node), TURN * sizeof(double));
    }
    at.e_in[at.e] = fraction;
    for (int k = 0; k < node->given; k++) {
        at.e_in[at.e + 1 + k] = node->numbers[k];
    }
    if (node->values == NULL) {
        memset(at.out, 0, (size_t)(at.terms + at.terms) * sizeof(double));
        memset(at.out_J, 0, (size_t)at.terms * at.e * sizeof(double));
        memset(at.out_H, 0, (size_t)at.e * at.e * sizeof(double));
        return 0;
    }
    return (order == 0 ? node->values : order == 1 ? node->by_zeta : node->twice)(
               arg, res, NULL, NULL, 0)
        || !finite(at.out, (size_t)at.terms);
}

/* b += factor a, of a row */
static void add(int count, double factor, const double *a, double *b)
{
    for (int j = 0; factor != 0.0 && j < count; j++) {
        b[j] += factor * a[j];
    }
}

/* Columns of the torques enter those of the tail's rates. */
static void damp_columns(const Node *node, double *rows, int count, int columns)
{
    const int m = node->tail, rates = ATTITUDE + m, torques = airborne_of(node);
    for (int i = 0; i < count && node->damping != 0.0; i++) {
        double *row = rows + (size_t)i * columns;
        for (int a = 0; a < m; a++) {
            row[rates + a] -= node->damping * row[torques + a];
        }
    }
}

static void damp_rows(const Node *node, double *H, int columns)
{
    const int m = node->tail, rates = ATTITUDE + m, torques = airborne_of(node);
    for (int a = 0; a < m && node->damping != 0.0; a++) {
        add(columns, -node->damping, H + (size_t)(torques + a) * columns,
            H + (size_t)(rates + a) * columns);
    }
}

/* Rows by (x, torques) as rows by (x, inputs): times P, the slopes of the former. */
static void chain_rows(const Node *node, Places at, const double *raw, int count, double *rows)
{
    const int own = airborne_of(node);
    memset(rows, 0, (size_t)count * at.air * sizeof *rows);
    for (int i = 0; i < count; i++, raw += at.raw, rows += at.air) {
        memcpy(rows, raw, (size_t)own * sizeof *rows);
        for (int k = own; k < at.raw; k++) {
            add(at.air, raw[k], at.driven_J + (size_t)k * at.air, rows);
        }
    }
}

/* J and H by (x, torques) as those by (x, inputs): J P, and P^T H P with the torques' own
   curvature. */
static int chain(const Node *node, Places at, int order)
{
    chain_rows(node, at, at.raw_J, at.air_y, at.air_J);
    if (order < 2) {
        return 0;
    }
    memset(at.driven_mu, 0, (size_t)at.raw * sizeof *at.driven_mu);
    for (int i = 0; i < at.air_y; i++) {
        add(at.raw, at.air_mu[i], at.raw_J + (size_t)i * at.raw, at.driven_mu);
    }
    if (evaluate_drive(node, at, 2) != 0) {
        return 1;
    }
    chain_rows(node, at, at.raw_H, at.raw, at.half);
    for (int i = 0; i < at.raw * at.air; i++) {
        add(at.air, at.driven_J[i], at.half + (size_t)(i / at.air) * at.air,
            at.air_H + (size_t)(i % at.air) * at.air);
    }
    return 0;
}

static void write_values(const Node *node, Places at, double *y)
{
    const int states = node->states, m = node->tail, own = airborne_of(node);
    const double *terms = at.out;
    if (m > 0) {
        memcpy(y, at.air_out, (size_t)own * sizeof *y);
        memcpy(y + own, at.z + states, (size_t)(states - own) * sizeof *y); /* torques' rates */
    } else {
        memcpy(y, terms, (size_t)states * sizeof *y);
        terms += states;
    }
    memcpy(y + states, terms, (size_t)(node->rows + 1) * sizeof *y);
    for (int i = 0; i < at.y; i++) {
        y[i] /= node->y_units[i];
    }
}

static void write_slopes(const Node *node, Places at, double *J)
{
    const int states = node->states, m = node->tail, own = airborne_of(node);
    const double *terms = at.out_J;
    memset(J, 0, (size_t)at.y * at.zeta * sizeof *J);
    for (int i = 0; i < at.y; i++) {
        double *row = J + (size_t)i * at.zeta;
        if (m > 0 && i < own) {
            memcpy(row, at.air_J + (size_t)i * at.air, (size_t)at.air * sizeof *row);
        } else if (m > 0 && i < states) {
            row[states + i - own] = 1.0;
        } else {
            const double *term = terms + (size_t)(i - (m > 0 ? states : 0)) * at.e;
            for (int j = 0; j < at.zeta; j++) {
                row[j] = term[in_e(node, j)];
            }
            for (int k = 0; m > 0 && node->uses_turn && k < TURN; k++) {
                add(at.air, term[states + k], at.air_J + (size_t)(own + k) * at.air, row);
            }
        }
        for (int j = 0; j < at.zeta; j++) {
            row[j] *= node->units[j] / node->y_units[i];
        }
    }
}

/* Of the terms along zeta: with omega's slopes O, that of [1; O]^T H [1; O]. */
static void write_curvature(const Node *node, Places at, double *H)
{
    const int n = at.zeta, states = node->states, m = node->tail;
    const double *O = at.air_J + (size_t)airborne_of(node) * at.air;
    for (int i = 0; i < n; i++) {
        const double *term = at.out_H + (size_t)in_e(node, i) * at.e;
        for (int j = 0; j < n; j++) {
            H[(size_t)i * n + j] = term[in_e(node, j)];
        }
    }
    for (int i = 0; i < at.air; i++) {
        add(at.air, 1.0, at.air_H + (size_t)i * at.air, H + (size_t)i * n);
    }
    for (int k = 0; m > 0 && node->uses_turn && k < TURN; k++) {
        const double *term = at.out_H + (size_t)(states + k) * at.e, *turn = O + k * at.air;
        for (int i = 0; i < n; i++) {
            const double own = i < at.air ? turn[i] : 0.0, mixed = term[in_e(node, i)];
            add(at.air, mixed, turn, H + (size_t)i * n);
            for (int j = 0; own != 0.0 && j < n; j++) {
                H[(size_t)i * n + j] += own * term[in_e(node, j)];
            }
            for (int l = 0; l < TURN; l++) {
                add(at.air, own * term[states + l], O + l * at.air, H + (size_t)i * n);
            }
        }
    }
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            H[(size_t)i * n + j] *= node->units[i] * node->units[j];
        }
    }
}

/* Weights of the terms, and of the emitted y: omega's are those that the terms have of it. */
static void write_weights(const Node *node, Places at, const double *mu)
{
    const int own = airborne_of(node), first = node->tail > 0 ? node->states : 0;
    for (int i = 0; i < at.terms; i++) {
        at.out_mu[i] = mu[first + i] / node->y_units[first + i];
    }
    for (int i = 0; node->tail > 0 && i < own; i++) {
        at.air_mu[i] = mu[i] / node->y_units[i];
    }
}

static int evaluate_airborne(const Node *node, Places at, int order)
{
    if (order == 0) {
        return node->rates(node->parameters, at.z, at.tau, node->momentum, at.air_out, at.work);
    }
    if (order == 1) {
        return node->slopes(node->parameters, at.z, at.tau, node->momentum, at.air_out, at.raw_J,
                            at.work);
    }
    return node->curvature(node->parameters, at.z, at.tau, node->momentum, at.air_mu, at.air_out,
                           at.raw_J, at.raw_H, at.work);
}

/* omega's weights: with terms that depend on omega, of these at omega. */
static int weigh_turn(const Node *node, Places at, double fraction)
{
    const int own = airborne_of(node);
    memset(at.air_mu + own, 0, TURN * sizeof(double));
    if (!node->uses_turn) {
        return 0;
    }
    if (evaluate_airborne(node, at, 0) != 0 || evaluate_terms(node, at, fraction, 1) != 0) {
        return 1;
    }
    for (int i = 0; i < at.terms; i++) {
        add(TURN, at.out_mu[i], at.out_J + (size_t)i * at.e + node->states, at.air_mu + own);
    }
    return 0;
}

int node_evaluate(const Node *node, const double *x, const double *u, const double *p,
                  double fraction, const double *mu, double *y, double *J, double *H,
                  double *scratch)
{
    const Places at = places_of(node, scratch);
    const int order = H != NULL ? 2 : J != NULL ? 1 : 0;
    if (in_si(node, at, x, u, p, order > 0) != 0) {
        return 1;
    }
    if (order == 2) {
        write_weights(node, at, mu);
        if (node->tail > 0 && weigh_turn(node, at, fraction) != 0) {
            return 1;
        }
    }
    if (node->tail > 0) {
        if (evaluate_airborne(node, at, order) != 0) {
            return 1;
        }
        damp_columns(node, at.raw_J, order > 0 ? at.air_y : 0, at.raw);
        if (order == 2) {
            damp_columns(node, at.raw_H, at.raw, at.raw);
            damp_rows(node, at.raw_H, at.raw);
        }
        if (node->inputs > 0 && order > 0 && chain(node, at, order) != 0) {
            return 1;
        }
    }
    if (evaluate_terms(node, at, fraction, order) != 0) {
        return 1;
    }
    write_values(node, at, y);
    if (J != NULL) {
        write_slopes(node, at, J);
    }
    if (H != NULL) {
        write_curvature(node, at, H);
    }
    return 0;
}

/* A model's dynamics at many nodes, with exact derivatives, as functions that CasADi calls.

   Groups of nodes go through the model's batches, a lane for each node; threads share the groups.
   Where which number lies is the host's decision: it configures each copy of this library once,
   before CasADi sees it. */

#include <pthread.h>
#include <stdint.h>
#include <string.h>

#include "algebra.h"

enum { MOST_THREADS = 64, LINE = 8 }; /* doubles of a cache line */

static Nodes nodes;

void nodes_configure(const Nodes *given)
{
    nodes = *given;
}

/* ---- one group of nodes */

/* A group's inputs, and its memory: a block for each node, and what batches work on. */
typedef struct {
    size_t count;
    const void *parameters;
    const double *inputs[INPUTS]; /* of the first node; zeros where CasADi gives none */
    size_t apart[INPUTS];         /* from a node to the next */
    double *blocks, *work;
} Group;

static const double *input_of(const Group *group, int k, size_t node)
{
    return group->inputs[k] + node * group->apart[k];
}

static double *part_of(const Group *group, int part, size_t node)
{
    return group->blocks + node * nodes.block + nodes.places[part];
}

/* Call a batch: of inputs of the group, or parts of its blocks, into parts of its blocks. */
static int call(const Group *group, int batch, const int *inputs, const int *parts)
{
    Call record = {.parameters = group->parameters, .count = group->count, .work = group->work};
    size_t apart[MOST_ARRAYS];
    int k = 0;
    for (; *inputs >= 0; inputs++, k++) {
        record.arrays[k] = (double *)(uintptr_t)group->inputs[*inputs];
        apart[k] = group->apart[*inputs];
    }
    for (; *parts >= 0; parts++, k++) {
        record.arrays[k] = part_of(group, *parts, 0);
        apart[k] = nodes.block;
    }
    return nodes.batches[batch](&record, apart);
}

static int jacobian(const Group *group)
{
    static const int state[] = {Q, V, LAST, -1}, attitude[] = {Q, -1};
    static const int forward[] = {DQ, DV, DLAST, -1}, inverse[] = {DQ, DV, -1};
    static const int mass[] = {DLAST, -1};
    if (call(group, FIRST, state, nodes.inverse ? inverse : forward) != 0
        || (nodes.inverse && call(group, MASS, attitude, mass) != 0)) {
        return 1;
    }
    for (size_t b = 0; b < group->count; b++) {
        by_quaternion(&nodes, input_of(group, Q, b), nodes.nv, part_of(group, DQ, b),
                      part_of(group, BY_Q, b));
    }
    return 0;
}

static int gradient(const Group *group)
{
    static const int given[] = {Q, V, LAST, WEIGHTS, -1};
    static const int found[] = {TURN_GRADIENT, V_GRADIENT, LAST_GRADIENT, -1};
    if (call(group, PRODUCT, given, found) != 0) {
        return 1;
    }
    for (size_t b = 0; b < group->count; b++) {
        quaternion_rows(&nodes, input_of(group, Q, b), 1, part_of(group, TURN_GRADIENT, b),
                        part_of(group, GRADIENT_Q, b));
    }
    return 0;
}

/* Second derivatives of weights^T results, by velocities: in QQ, QV, VV and BY_LAST_TANGENT. */
static int tangent_hessian(const Group *group)
{
    static const int state[] = {Q, V, LAST, -1}, attitude[] = {Q, -1}, moving[] = {Q, V, -1};
    static const int weighted[] = {Q, V, LAST, WEIGHTS, -1};
    static const int given[] = {V_DOT, MU, QQ, QV, VV, AQ, -1};
    static const int found[] = {QQ, QV, VV, AQ, -1}, v_dot[] = {V_DOT, -1}, mass[] = {H, -1};
    if (nodes.inverse) {
        return call(group, SECOND, weighted, found);
    }
    if (call(group, VALUE, state, v_dot) != 0 || call(group, MASS, attitude, mass) != 0) {
        return 1;
    }
    for (size_t b = 0; b < group->count; b++) {
        solve(nodes.nv, part_of(group, H, b), input_of(group, WEIGHTS, b), part_of(group, MU, b));
    }
    if (call(group, SECOND, moving, given) != 0) {
        return 1;
    }
    for (size_t b = 0; b < group->count; b++) {
        double *parts[] = {part_of(group, DQ, b), part_of(group, DV, b), part_of(group, DLAST, b),
                           part_of(group, QQ, b), part_of(group, QV, b), part_of(group, VV, b),
                           part_of(group, AQ, b), part_of(group, TQ, b)};
        eliminate(&nodes, parts);
    }
    return 0;
}

static int hessian(const Group *group)
{
    const size_t nq = nodes.nq, nv = nodes.nv, last = nodes.last;
    if (jacobian(group) != 0 || tangent_hessian(group) != 0) {
        return 1;
    }
    for (size_t b = 0; b < group->count; b++) {
        const double *q = input_of(group, Q, b), *weights = input_of(group, WEIGHTS, b);
        double *slope = part_of(group, GRADIENT_Q, b), *by_qq = part_of(group, BY_QQ, b);
        by_quaternion(&nodes, q, nv, part_of(group, QQ, b), part_of(group, HALF, b));
        quaternion_rows(&nodes, q, nq, part_of(group, HALF, b), by_qq);
        weighted_rows(nv, nq, part_of(group, BY_Q, b), weights, slope);
        add_curvature(nq, q, slope, by_qq);
        quaternion_rows(&nodes, q, nv, part_of(group, QV, b), part_of(group, BY_QV, b));
        by_quaternion(&nodes, q, last, part_of(group, nodes.inverse ? AQ : TQ, b),
                      part_of(group, BY_LAST, b));
    }
    return 0;
}

/* ---- all of them */

/* A call of CasADi's, and the nodes [first, end) of it that one thread evaluates. */
typedef struct {
    int kind;
    const double **arg;
    double **res;
    double *memory;
    const double *zeros;
    size_t first, end;
    int failed;
} Share;

static Group group_of(const Share *share, size_t first)
{
    const Ports *ports = nodes.kinds + share->kind;
    const size_t left = share->end - first;
    Group group = {.count = left < nodes.lanes ? left : nodes.lanes, .blocks = share->memory};
    group.work = share->memory + nodes.lanes * nodes.block;
    group.parameters = share->arg[PARAMETERS];
    for (int k = 0; k < INPUTS; k++) {
        const int from = ports->sources[k];
        const double *given = from < 0 ? NULL : share->arg[from];
        group.apart[k] = given == NULL ? 0 : nodes.sizes[k];
        group.inputs[k] = given == NULL ? share->zeros : given + first * nodes.sizes[k];
    }
    return group;
}

/* The nonzeros of each result, node after node. */
static void scatter(const Share *share, const Group *group, size_t first)
{
    const Ports *ports = nodes.kinds + share->kind;
    for (int64_t k = 0; k < ports->outputs; k++) {
        const size_t count = ports->nonzeros[k];
        const int *from = ports->offsets[k];
        double *to = share->res[k];
        for (size_t b = 0; to != NULL && b < group->count; b++) {
            const double *block = group->blocks + b * nodes.block;
            for (size_t j = 0; j < count; j++) {
                to[(first + b) * count + j] = block[from[j]];
            }
        }
    }
}

/* The results themselves, in place. */
static int values(const Share *share)
{
    const Group group = group_of(share, share->first);
    Call record = {group.parameters, share->end - share->first, 0, group.work, {NULL}};
    const size_t apart[] = {group.apart[Q], group.apart[V], group.apart[LAST], nodes.nv};
    if (share->res[0] == NULL) {
        return 0;
    }
    for (int k = 0; k < WEIGHTS; k++) {
        record.arrays[k] = (double *)(uintptr_t)group.inputs[k];
    }
    record.arrays[WEIGHTS] = share->res[0] + share->first * nodes.nv;
    return nodes.batches[VALUE](&record, apart);
}

static void *evaluate_share(void *data)
{
    static int (*const functions[])(const Group *) = {NULL, jacobian, gradient, hessian};
    Share *share = data;
    if (share->kind == VALUES) {
        share->failed = values(share);
        return NULL;
    }
    for (size_t first = share->first; first < share->end && !share->failed; first += nodes.lanes) {
        const Group group = group_of(share, first);
        share->failed = functions[share->kind](&group);
        if (!share->failed) {
            scatter(share, &group, first);
        }
    }
    return NULL;
}

static double *aligned(double *w)
{
    return w + (64 - (uintptr_t)w % 64) % 64 / sizeof *w;
}

/* Doubles of a thread, in whole cache lines. */
static size_t memory_of_thread(void)
{
    return (nodes.lanes * nodes.block + nodes.work + LINE - 1) / LINE * LINE;
}

static int evaluate(int kind, const double **arg, double **res, double *w)
{
    const Ports *ports = nodes.kinds + kind;
    const size_t groups = (nodes.count + nodes.lanes - 1) / nodes.lanes;
    const size_t zeros = (nodes.nq + LINE - 1) / LINE * LINE;
    size_t threads = (size_t)ports->threads;
    Share shares[MOST_THREADS];
    pthread_t helpers[MOST_THREADS];
    int started[MOST_THREADS] = {0}, failed = 0;
    threads = threads < MOST_THREADS ? threads : MOST_THREADS;
    w = aligned(w);
    memset(w, 0, nodes.nq * sizeof *w);
    if (ports->filled >= 0 && res[ports->filled] != NULL) { /* by the parameters: zeros */
        memset(res[ports->filled], 0, nodes.parameters * sizeof *w);
    }
    for (size_t k = 0; k < threads; k++) {
        const size_t end = (k + 1) * groups / threads * nodes.lanes;
        Share share = {kind, arg, res, w + zeros + k * memory_of_thread(), w,
                       k * groups / threads * nodes.lanes, end < nodes.count ? end : nodes.count,
                       0};
        shares[k] = share;
        started[k] = k > 0
                  && pthread_create(helpers + k, NULL, evaluate_share, shares + k) == 0;
    }
    for (size_t k = 0; k < threads; k++) {
        if (started[k]) {
            pthread_join(helpers[k], NULL);
        } else {
            evaluate_share(shares + k);
        }
        failed |= shares[k].failed;
    }
    return failed;
}

static int64_t sizes_of(int kind, long long *args, long long *ress, long long *ints, long long *w)
{
    const Ports *ports = nodes.kinds + kind;
    const size_t threads = ports->threads < MOST_THREADS ? (size_t)ports->threads : MOST_THREADS;
    *args = ports->inputs;
    *ress = ports->outputs;
    *ints = 0;
    *w = (long long)(threads * memory_of_thread() + nodes.nq + 2 * LINE);
    return 0;
}

/* ---- what CasADi asks for: a function, and others beside it by their names.  FACE(f, kind) */

#define EVERY(type, name, value)                                                                   \
    type name(long long i);                                                                        \
    type name(long long i)                                                                         \
    {                                                                                              \
        return value;                                                                              \
    }

#define FACE(name, kind)                                                                           \
    int name(const double **arg, double **res, long long *iw, double *w, int mem);                 \
    int name(const double **arg, double **res, long long *iw, double *w, int mem)                  \
    {                                                                                              \
        (void)iw;                                                                                  \
        (void)mem;                                                                                 \
        return evaluate(kind, arg, res, w);                                                        \
    }                                                                                              \
    int name##_work(long long *args, long long *ress, long long *ints, long long *w);              \
    int name##_work(long long *args, long long *ress, long long *ints, long long *w)               \
    {                                                                                              \
        return (int)sizes_of(kind, args, ress, ints, w);                                           \
    }                                                                                              \
    long long name##_n_in(void);                                                                   \
    long long name##_n_in(void)                                                                    \
    {                                                                                              \
        return nodes.kinds[kind].inputs;                                                           \
    }                                                                                              \
    long long name##_n_out(void);                                                                  \
    long long name##_n_out(void)                                                                   \
    {                                                                                              \
        return nodes.kinds[kind].outputs;                                                          \
    }                                                                                              \
    EVERY(const char *, name##_name_in, nodes.kinds[kind].names_in[i])                             \
    EVERY(const char *, name##_name_out, nodes.kinds[kind].names_out[i])                           \
    EVERY(const long long *, name##_sparsity_in, nodes.kinds[kind].patterns_in[i])                 \
    EVERY(const long long *, name##_sparsity_out, nodes.kinds[kind].patterns_out[i])               \
    EVERY(int, name##_diff_in, nodes.kinds[kind].differentiable_in[i])                             \
    EVERY(int, name##_diff_out, nodes.kinds[kind].differentiable_out[i])

FACE(nodes0, VALUES)
FACE(nodes1, VALUES)
FACE(jac_nodes1, JACOBIAN)
FACE(nodes2, VALUES)
FACE(jac_nodes2, JACOBIAN)
FACE(adj1_nodes2, GRADIENT)
FACE(jac_adj1_nodes2, HESSIAN)

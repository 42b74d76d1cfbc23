/* What the host tells of a model and of a number of nodes. */

#ifndef SERPENTAIL_NODES_H
#define SERPENTAIL_NODES_H

#include <stddef.h>
#include <stdint.h>

enum { MOST_ARRAYS = 10 };

/* The argument record of a model's functions: inputs, then outputs. */
typedef struct {
    const void *parameters;
    size_t count, failed;
    double *work;
    double *arrays[MOST_ARRAYS];
} Call;

/* A model's batch; apart: numbers from one state to the next. */
typedef int (*Batch)(Call *call, const size_t *apart);

/* Functions; the model's batches they need; inputs of a node (last: tau or v_dot); parts of its
   block of numbers.  The host has the same lists. */
enum { VALUES, JACOBIAN, GRADIENT, HESSIAN, KINDS };
enum { VALUE, FIRST, MASS, PRODUCT, SECOND, BATCHES };
enum { Q, V, LAST, WEIGHTS, INPUTS };
enum { PARAMETERS = 3 }; /* which input of CasADi's they are */
enum {
    DQ, DV, DLAST, BY_Q, TURN_GRADIENT, V_GRADIENT, LAST_GRADIENT, GRADIENT_Q, V_DOT, H, MU,
    QQ, QV, VV, AQ, TQ, HALF, BY_QQ, BY_QV, BY_LAST, PARTS
};

/* One function's inputs and outputs for CasADi. */
typedef struct {
    int64_t inputs, outputs;
    const char *const *names_in, *const *names_out;
    const long long *const *patterns_in, *const *patterns_out;
    const int *differentiable_in, *differentiable_out;
    int sources[INPUTS];       /* which input of CasADi's each of ours is; -1: none */
    const size_t *nonzeros;    /* of each output, of one node */
    const int *const *offsets; /* of these nonzeros in a node's block */
    int filled;                /* the output by the parameters, which is zero; -1: none */
    int threads;
} Ports;

typedef struct {
    int inverse; /* inverse dynamics, or forward dynamics */
    size_t nq, nv, last, parameters;
    size_t count, lanes; /* nodes in all, and in a group */
    size_t block, work;  /* doubles: of a node's block, and of what batches work on */
    size_t sizes[INPUTS];
    size_t places[PARTS]; /* in a node's block */
    Batch batches[BATCHES];
    Ports kinds[KINDS];
} Nodes;

#endif

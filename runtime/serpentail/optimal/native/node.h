/* A node: what holds at one time of a motion, in the program's units.

   Of zeta = (states x, controls u, constants p), the last of which is the duration of the motion,
   and of the time as a fraction of it, a node gives y = (rates of x by s, rows, cost): rows are
   what has bounds, and the cost is what is integrated.  J = dy / dzeta by rows, H of mu^T y.

   A node is a model's emitted airborne rates with terms for rows and cost, or terms alone.  Terms
   are functions of e = (x, omega, u, p, fraction, given numbers) in SI units, omega being there
   with airborne rates only. */

#ifndef SERPENTAIL_NODE_H
#define SERPENTAIL_NODE_H

#include <stddef.h>

enum { ATTITUDE = 4, TURN = 3 }; /* sizes of a quaternion c and of omega */

/* A model's functions in SI units: of (c, q_t, q_t_dot), c being a quaternion of any norm, the
   torques tau and the angular momentum h about the centre of mass (world axes), y = (c_dot,
   q_t_dot, q_t_ddot, omega), J of y by (c, q_t, q_t_dot, tau), and H.  0: all is finite. */
typedef int (*Rates)(const void *parameters, const double *x, const double *tau, const double *h,
                     double *y, double *work);
typedef int (*Slopes)(const void *parameters, const double *x, const double *tau, const double *h,
                      double *y, double *J, double *work);
typedef int (*Curvature)(const void *parameters, const double *x, const double *tau,
                         const double *h, const double *mu, double *y, double *J, double *H,
                         double *work);
/* CasADi's: of e to values; of e to values and their J by rows; of e and mu to values, J and H;
   derivatives are by (x, omega, u, p). */
typedef int (*Terms)(const double **arg, double **res, long long *iw, double *w, int memory);

/* Arrays are the caller's. */
typedef struct {
    int states, controls, constants, rows;
    int tail;                    /* tail coordinates of airborne rates; 0: terms give the rates */
    int drift;                   /* in air 6: after q_t_dot, velocity against it and omega; else 0 */
    int uses_turn;               /* whether terms depend on omega */
    Rates rates;
    Slopes slopes;
    Curvature curvature;
    const void *parameters;      /* of the model */
    const double *momentum;      /* (3) h */
    double damping;              /* N m s, of the joints, beside the torques */
    int work;                    /* doubles that the emitted functions work on */
    int given;                   /* numbers that terms are given: how many, and which */
    const double *numbers;
    Terms values, by_zeta, twice; /* NULL: no rows and no cost */
    const double *units;         /* (x, u, p) */
    const double *y_units;       /* (rates, rows, cost) */
    int inputs;                  /* 0: the torques of all coordinates follow the airborne state; */
    Terms drive, drive_slopes, drive_twice; /* else so many inputs do: tensions, or torques of */
                                            /* motors; and this is (x, torques) of (x, inputs) */
} Node;

static inline int zeta_of(const Node *node)
{
    return node->states + node->controls + node->constants;
}

static inline int y_of_node(const Node *node)
{
    return node->states + node->rows + 1;
}

size_t node_scratch(const Node *node);
/* In the program's units; zeta is in three parts.  0 where all is finite; J and mu, H may be
   NULL. */
int node_evaluate(const Node *node, const double *x, const double *u, const double *p,
                  double fraction, const double *mu, double *y, double *J, double *H,
                  double *scratch);

#endif

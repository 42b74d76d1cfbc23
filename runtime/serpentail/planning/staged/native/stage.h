/* A plan's program, cut into stages: what an interval-by-interval solver asks of it.

   A stage is a control interval: torques are one polynomial in it, whose Bernstein coefficients
   are the stage's controls, and one or more intervals of the mesh lie in it.  Its variables are
   v = (coefficients, state at its start, duration of the flight), all in the program's units; the
   collocation equations of its intervals are solved inside.  What it gives are its results r =
   (state at its end, bounded states at its inner nodes, cost), their Jacobian, and the Hessian of
   mu^T r, exact by the implicit function theorem. */

#ifndef SERPENTAIL_STAGE_H
#define SERPENTAIL_STAGE_H

#include <stddef.h>

/* A model's functions of one node in SI units: of x = (c, q_t, q_t_dot), c being a quaternion of any
   norm, the torques tau and the angular momentum h about the centre of mass (world axes) they give
   y = (c_dot, q_t_dot, q_t_ddot, omega), J = dy / d(x, tau) by rows, and H of mu^T y.  0: all is
   finite. */
typedef int (*Rates)(const void *parameters, const double *x, const double *tau, const double *h,
                     double *y, double *work);
typedef int (*Slopes)(const void *parameters, const double *x, const double *tau, const double *h,
                      double *y, double *J, double *work);
typedef int (*Curvature)(const void *parameters, const double *x, const double *tau,
                         const double *h, const double *mu, double *y, double *J, double *H,
                         double *work);

enum { ATTITUDE = 4, TURN = 3 }; /* sizes of c and of omega */
enum { EFFORT, ENERGY };         /* costs of a node, see cost.c */
/* A result that cannot be had, since FATROP does not take nan for worse than all numbers, and the
   largest derivative that counts as one: with larger ones it looks for a step without end. */
static const double FAR = 1e8;

/* What a plan asks for; arrays are the caller's, and outlive the program.  SI where no unit is
   named. */
typedef struct {
    /* sizes: stages N, intervals I, nodes of an interval K, tail coordinates m, coefficients of a
       torque in a stage C */
    int stages, intervals, nodes, tail, coefficients;
    const int *first;      /* (N + 1) first interval of each stage, and I */
    const double *widths;  /* (I) of the intervals, fractions of the duration */
    const double *basis;   /* (I, K, C) torques at the nodes, of the coefficients */
    const double *states;  /* (K, K + 1) of the rule: states X, times .. = h F */
    const double *weights; /* (K) of the rule's quadrature */

    Rates rates;
    Slopes slopes;
    Curvature curvature;
    const void *parameters;   /* of the model */
    int work;                 /* doubles that the functions work on */
    const double *momentum;   /* (3) h */
    double damping;           /* N m s, of the joints, beside the torques */
    const double *state_unit, *torque_unit, *turn_unit; /* (4 + 2m), (m), (3) */

    int cost;               /* EFFORT or ENERGY */
    double smoothing;       /* N m s, of EFFORT */
    double softening;       /* W, of ENERGY */
    double cost_unit;       /* of the integrand */
    double price;           /* of a second of the flight */

    const double *start;    /* (4 + 2m), in units */
    double shortest, longest; /* s; equal where the duration is no variable */
    const double *most_torque, *most_angle, *most_rate; /* (m) magnitudes in units, or NULL */
    double give;            /* what squares of the goal's rows cost, twice: see ocp.h */
    int goal_rows;
    const double *goal;     /* (goal_rows, 4): rows that are zero at the attitude of the end */
    const double *end_state;/* (4 + 2m) in units, nan where it is free */
    const double *end_turn; /* (3) omega in units, nan where it is free */
} Task;

/* Memory and results of one stage.  z are the states at its nodes, y what the nodes give there,
   zeta = (state, torque) what they are given. */
typedef struct {
    const Task *task;
    int first, pieces;            /* its intervals: the first of them, and how many */
    int variables, results;       /* sizes of v and r */
    int bounded, first_bounded;   /* states that have bounds: how many, and the first of them */
    double *v, *z, *y, *r;        /* z (pieces, K, states), y (pieces, K, y), and r, of v */
    double *J;                    /* (pieces, K, y, zeta) of the nodes */
    double *factors;              /* (pieces, K states, K states) of the equations' Jacobians */
    int *pivots;                  /* (pieces, K states) */
    double *slopes;               /* (pieces, K states, variables) dz / dv */
    double *Jr;                   /* (results, variables) dr / dv */
    double *from_v, *from_z;      /* v and z that the slopes are of; z is a guess at first */
    double *scratch;
    int known, failed;            /* whether v is known, and has no z */
    int sloped, factored;         /* whether slopes and factors are there, as of any v */
    long node_calls, newton_steps;
    double *given;                /* v where the program evaluates it, see all_stages.c */
    double *mu, *H;               /* weights of r, and its Hessian with them */
    int curved;                   /* whether H could be had */
} Stage;

/* lu.c: matrices row by row */
int factorise(int n, double *A, int *pivots); /* 1 where A is singular */
void subtract_rows(int count, const double *factors, const double *A, int stride, double *b,
                   int columns); /* b -= factors A */
void solve(int n, const double *A, const int *pivots, int columns, double *B);
void solve_transposed(int n, const double *A, const int *pivots, double *b);

/* lu.c: whether all are finite, and below FAR */
int is_moderate(const double *values, size_t count);

/* node.c: a node in the program's units; 0 where all is finite */
int node_rates(const Task *task, const double *x, const double *torque, double *y,
               double *scratch);
int node_slopes(const Task *task, const double *x, const double *torque, double *y, double *J,
                double *scratch);
int node_curvature(const Task *task, const double *x, const double *torque, const double *mu,
                   double *y, double *J, double *H, double *scratch);
size_t node_scratch(const Task *task);

/* cost.c: the cost of a node, by torque and tail rate in units; its slopes (2, m), torques first,
   and curvatures (3, m) by torque twice, torque and rate, rate twice; both may be NULL */
double cost_of(const Task *task, const double *torque, const double *rate, double *slope,
               double *curvature);

/* stage.c */
size_t stage_lay_out(Stage *stage, const Task *task, int index, double *memory);
size_t stage_pivots(const Stage *stage);
int stage_values(Stage *stage, const double *v); /* z, y and r of v; 1 where there are none */
int stage_slopes(Stage *stage, const double *v); /* slopes and Jr, too */
int stage_hessian(Stage *stage, const double *v, const double *mu, double *H); /* of mu^T r */

#endif

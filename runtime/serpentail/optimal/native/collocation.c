/* The collocation equations of one interval, solved by a damped Newton. */

#include "stage_layout.h"

/* largest residual that counts as none, in units; where rounding keeps it above, so much will do */
static const double TIGHT = 1e-12, LOOSE = 1e-9;
enum { MOST_STEPS = 40 };
static const double SHORTEST_STEP = 1.0 / 128, SLOW = 0.1;

int evaluate_node(Stage *stage, const double *v, int p, int i, const double *x, const double *mu,
                  double *J, double *H)
{
    const Phase *phase = stage->phase;
    const Node *node = phase->node;
    const double *basis = basis_of(stage, p, i);
    double *u = stage->scratch;
    for (int a = 0; a < node->controls; a++) {
        u[a] = 0.0;
        for (int j = 0; j < phase->coefficients; j++) {
            u[a] += basis[j] * v[j * node->controls + a];
        }
    }
    return node_evaluate(node, x, u, constants_of(stage, v), phase->fractions[place_of(stage, p, i)],
                         mu, y_of(stage, p, i), J, H, u + node->controls);
}

/* Evaluate the nodes of interval p at the states z, with their Jacobians where they are wanted. */
static int evaluate(Stage *stage, const double *v, int p, const double *z, int slopes)
{
    for (int i = 0; i < stage->phase->nodes; i++) {
        const double *x = z + (size_t)i * states_of(stage->phase);
        double *J = slopes ? J_of(stage, p, i) : NULL;
        if (evaluate_node(stage, v, p, i, x, NULL, J, NULL) != 0) {
            return 1;
        }
    }
    return 0;
}

/* Of one call: a node's controls and scratch, and three residuals. */
size_t collocation_scratch(const Stage *stage)
{
    const Node *node = stage->phase->node;
    return (size_t)node->controls + node_scratch(node) + 3 * (size_t)unknowns_of(stage->phase);
}

/* Residuals of the collocation equations at z, r = states X - h F; returns the largest, or
   infinity. */
static double residual(Stage *stage, const double *v, int p, const double *z, double *r)
{
    const Phase *phase = stage->phase;
    const int K = phase->nodes, states = states_of(phase);
    const double *start = start_of(stage, v, p);
    const double h = duration_of(stage, v, p);
    double largest = 0.0;
    if (evaluate(stage, v, p, z, 0) != 0) {
        return INFINITY;
    }
    for (int i = 0; i < K; i++) {
        const double *rule = phase->states + (size_t)i * (K + 1), *f = y_of(stage, p, i);
        double *own = r + (size_t)i * states;
        for (int a = 0; a < states; a++) {
            own[a] = rule[0] * start[a] - h * f[a];
            for (int j = 0; j < K; j++) {
                own[a] += rule[j + 1] * z[(size_t)j * states + a];
            }
            largest = fabs(own[a]) <= largest ? largest : fabs(own[a]);
        }
    }
    return isfinite(largest) ? largest : INFINITY;
}

/* Factorise the Jacobian of interval p's equations by z. */
int linearise(Stage *stage, const double *v, int p, const double *z)
{
    const Phase *phase = stage->phase;
    const int K = phase->nodes, states = states_of(phase), d = unknowns_of(phase);
    const int zeta = zeta_of(phase->node);
    const double h = duration_of(stage, v, p);
    double *G = factors_of(stage, p);
    if (evaluate(stage, v, p, z, 1) != 0) {
        return 1;
    }
    memset(G, 0, (size_t)d * d * sizeof *G);
    for (int i = 0; i < K; i++) {
        const double *rule = phase->states + (size_t)i * (K + 1), *J = J_of(stage, p, i);
        for (int a = 0; a < states; a++) {
            double *row = G + ((size_t)i * states + a) * d;
            for (int b = 0; b < states; b++) {
                row[i * states + b] = -h * J[(size_t)a * zeta + b];
            }
            for (int j = 0; j < K; j++) {
                row[j * states + a] += rule[j + 1];
            }
        }
    }
    return factorise(d, G, pivots_of(stage, p));
}

/* Solve for the states z at the nodes of interval p, from z; 1 where that fails. */
static int newton(Stage *stage, const double *v, int p, double *z)
{
    const int d = unknowns_of(stage->phase);
    double *r = stage->scratch + collocation_scratch(stage) - 3 * (size_t)d;
    double *trial = r + d, *trial_r = trial + d;
    double largest = residual(stage, v, p, z, r);
    int fresh = 0, slow = !stage->factored;
    for (int count = 0; count < MOST_STEPS && isfinite(largest) && largest > TIGHT; count++) {
        double part = 1.0, reached;
        if (slow) {
            if (linearise(stage, v, p, z) != 0) {
                return 1;
            }
            fresh = 1;
        }
        solve(d, factors_of(stage, p), pivots_of(stage, p), 1, r);
        for (;;) {
            for (int a = 0; a < d; a++) {
                trial[a] = z[a] - part * r[a];
            }
            reached = residual(stage, v, p, trial, trial_r);
            if (reached < (1 - part / 4) * largest || !fresh || part <= SHORTEST_STEP) {
                break;
            }
            if (largest <= LOOSE) { /* rounding */
                return !isfinite(residual(stage, v, p, z, r));
            }
            part /= 2;
        }
        slow = reached > SLOW * largest;
        if (reached < (1 - part / 4) * largest) {
            memcpy(z, trial, (size_t)d * sizeof *z);
            memcpy(r, trial_r, (size_t)d * sizeof *r);
            largest = reached;
        } else if (fresh) {
            return 1;
        } else { /* with factors of other states */
            largest = residual(stage, v, p, z, r);
        }
        fresh = 0;
    }
    return !(largest <= LOOSE);
}

/* z of interval p as the slopes foretell it. */
static void foretell(const Stage *stage, const double *v, int p, double *z)
{
    const int d = unknowns_of(stage->phase), n = stage->variables;
    const double *slopes = slopes_of(stage, p);
    memcpy(z, stage->from_z + (size_t)p * d, (size_t)d * sizeof *z);
    if (!stage->sloped) {
        return;
    }
    for (int a = 0; a < d; a++) {
        for (int c = 0; c < n; c++) {
            z[a] += slopes[(size_t)a * n + c] * (v[c] - stage->from_v[c]);
        }
    }
}

/* Solve interval p: from what the slopes foretell, from where they are of, from its start. */
int collocate(Stage *stage, const double *v, int p)
{
    const int d = unknowns_of(stage->phase), states = states_of(stage->phase);
    double *z = stage->z + (size_t)p * d;
    foretell(stage, v, p, z);
    if (newton(stage, v, p, z) == 0) {
        return 0;
    }
    stage->factored = 0;
    memcpy(z, stage->from_z + (size_t)p * d, (size_t)d * sizeof *z);
    if (newton(stage, v, p, z) == 0) {
        return 0;
    }
    for (int a = 0; a < d; a++) {
        z[a] = start_of(stage, v, p)[a % states];
    }
    return newton(stage, v, p, z);
}

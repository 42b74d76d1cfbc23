/* The collocation equations of one interval, solved by a damped Newton. */

#include <math.h>
#include <string.h>

#include "stage_layout.h"

/* largest residual that counts as none, in units; where rounding keeps it above, so much will do */
static const double TIGHT = 1e-12, LOOSE = 1e-9;
enum { MOST_STEPS = 40 };
static const double SHORTEST_STEP = 1.0 / 128, SLOW = 0.1;

/* Torques (m) at a node, of the coefficients in v. */
void torques_at(const Stage *stage, const double *v, int p, int i, double *torques)
{
    const Task *task = stage->task;
    const double *basis = basis_of(stage, p, i);
    for (int a = 0; a < task->tail; a++) {
        torques[a] = 0.0;
        for (int j = 0; j < task->coefficients; j++) {
            torques[a] += basis[j] * v[j * task->tail + a];
        }
    }
}

/* Evaluate the nodes of interval p at the states z, with their Jacobians where they are wanted. */
static int evaluate(Stage *stage, const double *v, int p, const double *z, int slopes)
{
    const Task *task = stage->task;
    double *torques = stage->scratch, *scratch = torques + task->tail;
    for (int i = 0; i < task->nodes; i++) {
        torques_at(stage, v, p, i, torques);
        stage->node_calls++;
        const double *x = z + (size_t)i * states_of(task);
        double *y = y_of(stage, p, i);
        const int failed = slopes ? node_slopes(task, x, torques, y, J_of(stage, p, i), scratch)
                                  : node_rates(task, x, torques, y, scratch);
        if (failed) {
            return 1;
        }
    }
    return 0;
}

/* Residuals of the collocation equations at z, r = states X - h F; returns the largest, or
   infinity. */
static double residual(Stage *stage, const double *v, int p, const double *z, double *r)
{
    const Task *task = stage->task;
    const int K = task->nodes, states = states_of(task);
    const double *start = start_of(stage, v, p);
    const double h = v[stage->variables - 1] * width_of(stage, p);
    double largest = 0.0;
    if (evaluate(stage, v, p, z, 0) != 0) {
        return INFINITY;
    }
    for (int i = 0; i < K; i++) {
        const double *rule = task->states + (size_t)i * (K + 1), *f = y_of(stage, p, i);
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
    const Task *task = stage->task;
    const int K = task->nodes, states = states_of(task), d = unknowns_of(task);
    const int zeta = size_of_zeta(task);
    const double h = v[stage->variables - 1] * width_of(stage, p);
    double *G = factors_of(stage, p);
    if (evaluate(stage, v, p, z, 1) != 0) {
        return 1;
    }
    memset(G, 0, (size_t)d * d * sizeof *G);
    for (int i = 0; i < K; i++) {
        const double *rule = task->states + (size_t)i * (K + 1), *J = J_of(stage, p, i);
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
    const int d = unknowns_of(stage->task);
    double *r = stage->scratch + stage->task->tail + node_scratch(stage->task);
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
        stage->newton_steps++;
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
    const int d = unknowns_of(stage->task), n = stage->variables;
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
    const int d = unknowns_of(stage->task), states = states_of(stage->task);
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

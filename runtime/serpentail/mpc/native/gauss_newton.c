/* One Gauss-Newton step of a correction, within bounds of the torques and of the tail. */

#include <float.h>
#include <math.h>
#include <string.h>

#include "mpc_layout.h"

static const double ROUNDING = 1e-9 + 64 * DBL_EPSILON; /* relative, of a sum of squares */
static const double PRICE = 1e6; /* per rad or rad/s beyond a bound: what a goal's error costs is less */
static const double LENIENT = 1e-3; /* of a bound: an excess so small is no event */

double mpc_between(double value, double lower, double upper)
{
    return value < lower ? lower : value > upper ? upper : value;
}

/* Compute bounds of each number of the correction: those of the torque minus the plan's torque, at
   both ends of all Runge-Kutta steps in its interval. */
void mpc_write_bounds(mpc_workspace *w)
{
    const mpc_motion *motion = &w->motion;
    const mpc_task *task = motion->task;
    const int m = task->tail;
    for (int j = 0; j < task->intervals; j++) {
        double *lower = w->lower + j * m, *upper = w->upper + j * m;
        for (int a = 0; a < m; a++) {
            lower[a] = -NONE;
            upper[a] = NONE;
        }
        for (int i = 0; i <= task->steps; i++) {
            const double part = (double)i / (double)task->steps;
            const double t = motion->begin + ((double)j + part) * motion->width;
            mpc_planned(task, t, t, 0, m, motion->table);
            for (int a = 0; a < m; a++) {
                const double down = -task->most_torque[a] - motion->table[a];
                const double up = task->most_torque[a] - motion->table[a];
                lower[a] = down > lower[a] ? down : lower[a];
                upper[a] = up < upper[a] ? up : upper[a];
            }
        }
        for (int a = 0; a < m; a++) { /* the plan itself exceeds the bounds */
            if (lower[a] > upper[a]) {
                lower[a] = upper[a] = 0.5 * (lower[a] + upper[a]);
            }
        }
    }
}

int mpc_write_limits(mpc_workspace *w, const double *correction)
{
    const mpc_motion *motion = &w->motion;
    const int n = w->qp.n, both = 2 * motion->task->tail;
    int widened = 0;
    for (int i = 0; i < n; i++) {
        w->low[i] = w->lower[i] - correction[i];
        w->high[i] = w->upper[i] - correction[i];
    }
    for (int r = 0; r < w->qp.rows; r++) {
        const double most = motion->task->most_tail[r % both], *slope = motion->S_extreme + r * n;
        double limit = most, least = motion->extreme[r], greatest = least;
        if (most < NONE) {
            for (int i = 0; i < n; i++) {
                least += slope[i] * (slope[i] > 0.0 ? w->low[i] : w->high[i]);
                greatest += slope[i] * (slope[i] > 0.0 ? w->high[i] : w->low[i]);
            }
            least *= 1.0 + LENIENT;
            greatest *= -1.0 - LENIENT;
            limit = least > limit ? least : greatest > limit ? greatest : limit;
            const double now = r < both ? fabs(w->x0[MPC_ATTITUDE + r]) : 0.0;
            limit = now > limit ? now : limit;
            widened = widened || limit > most * (1.0 + LENIENT);
        }
        w->limit[r] = limit;
        w->low[n + r] = -limit - motion->extreme[r];
        w->high[n + r] = limit - motion->extreme[r];
    }
    return widened;
}

/* The sum of all that the last motion's angles and rates are beyond their limits. */
static double excess_of(const mpc_workspace *w)
{
    double sum = 0.0;
    for (int r = 0; r < w->qp.rows; r++) {
        const double over = fabs(w->motion.extreme[r]) - w->limit[r];
        sum += over > LENIENT * w->limit[r] ? over : 0.0;
    }
    return sum;
}

/* Lower the sum of squares, plus the price of what exceeds bounds, by one Gauss-Newton step from the
   correction; return 0 for success. */
int mpc_improve(mpc_state *state, mpc_workspace *w, double *correction)
{
    const int n = w->qp.n;
    mpc_program trial = {0.0, 0.0, NULL, NULL};
    w->motion.correction = correction;
    if (mpc_program_of(&w->motion, w->x0, &w->program) != 0) {
        return MPC_FAR;
    }
    const int widened = mpc_write_limits(w, correction);
    const double excess = excess_of(w);
    w->qp.price = PRICE;
    const int changes = mpc_quadratic(&w->qp);
    if (changes < 0) {
        return 1;
    }
    state->steps++;
    state->set_changes += changes;
    state->flags |= changes >= w->qp.most ? MPC_LIMIT : 0;
    const double price = 2.0 * w->qp.paid, before = w->program.cost + price * excess;
    double part = 1.0;
    w->motion.correction = w->trial;
    for (int k = 0; k < MPC_TRIALS; k++, part *= 0.5) {
        for (int i = 0; i < n; i++) {
            w->trial[i] = mpc_between(correction[i] + part * w->qp.d[i], w->lower[i], w->upper[i]);
        }
        state->trials++;
        if (mpc_program_of(&w->motion, w->x0, &trial) == 0) {
            const double over = excess_of(w);
            if (trial.cost + price * over <= before * (1.0 + ROUNDING)) {
                memcpy(correction, w->trial, (size_t)n * sizeof *correction);
                state->off = sqrt(trial.off);
                state->flags &= ~MPC_BOUND;
                state->flags |= widened || over > 0.0 ? MPC_BOUND : 0;
                return 0;
            }
        }
    }
    return 1;
}

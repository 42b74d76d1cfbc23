/* A tick: the plan at a time, the error from it, and the torques. */

#include <math.h>

#include "gains.h"

/* Return the last of some increasing times that is not after t; the first if all are. */
static int last_before(const gains_real *times, int count, gains_real t)
{
    int first = 0, end = count;
    while (end - first > 1) {
        const int middle = (first + end) / 2;
        if (times[middle] <= t) {
            first = middle;
        } else {
            end = middle;
        }
    }
    return first;
}

/* Evaluate the plan's channels first to end - 1 at t. */
static void planned(const gains_task *task, gains_real t, int first, int end, gains_real *values)
{
    const int piece = last_before(task->times, task->pieces, t), powers = task->powers;
    const int channels = 3 * task->tail + GAINS_PLANNED;
    const gains_real most = task->times[task->pieces];
    const gains_real at = (t < 0 ? 0 : t > most ? most : t) - task->times[piece];
    const gains_real *row = task->plan + (piece * channels + first) * powers;
    for (int c = first; c < end; c++, row += powers) {
        gains_real value = row[powers - 1];
        for (int k = powers - 2; k >= 0; k--) {
            value = value * at + row[k];
        }
        values[c - first] = value;
    }
}

/* Turn the planned (quaternion, angular velocity, tail, rates) at e + 1 into the error e; return the
   square of the norm of q's quaternion. */
static gains_real error(int m, const gains_real *q, const gains_real *v, gains_real *e)
{
    const gains_real w = e[1], x = e[2], y = e[3], z = e[4], *r = q + 3;
    const gains_real sign = w * r[0] + x * r[1] + y * r[2] + z * r[3] < 0 ? -2 : 2;
    e[0] = sign * (w * r[1] - x * r[0] - y * r[3] + z * r[2]);
    e[1] = sign * (w * r[2] + x * r[3] - y * r[0] - z * r[1]);
    e[2] = sign * (w * r[3] - x * r[2] + y * r[1] - z * r[0]);
    for (int i = 0; i < 3; i++) {
        e[3 + i] = v[3 + i] - e[5 + i];
    }
    for (int a = 0; a < m; a++) {
        e[GAINS_TORSO + a] = q[7 + a] - e[8 + a];
    }
    for (int a = 0; a < m; a++) {
        e[GAINS_TORSO + m + a] = v[6 + a] - e[8 + m + a];
    }
    return r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3];
}

/* Return e^T C e; row: C, row by row up to the diagonal, what is beside the diagonal twice. */
static gains_real cost(int n, const gains_real *row, const gains_real *e)
{
    gains_real sum = 0;
    for (int i = 0; i < n; i++) {
        gains_real part = 0;
        for (int j = 0; j <= i; j++) {
            part += *row++ * e[j];
        }
        sum += part * e[i];
    }
    return sum;
}

int gains_memory_size(const gains_task *task)
{
    return 1 + GAINS_PLANNED + 2 * task->tail;
}

void gains_begin(gains_state *state, const gains_task *task, gains_real *memory)
{
    state->task = task;
    state->memory = memory;
    state->ticks = state->failed = state->saturated = state->beyond = 0;
}

int gains_tick(gains_state *state, gains_real t, const gains_real *q, const gains_real *v,
               gains_real *tau)
{
    const gains_task *task = state->task;
    const int m = task->tail, n = GAINS_TORSO + 2 * m;
    gains_real *e = state->memory;
    const gains_real late = t + task->period / 1000; /* a t that was rounded down counts as reached */
    int told = 0;
    if (!(late < task->times[task->pieces])) {
        for (int a = 0; a < m; a++) {
            tau[a] = 0;
        }
        return 0;
    }
    state->ticks++;
    planned(task, t, m, 3 * m + GAINS_PLANNED, e + 1);
    planned(task, t + task->period / 2, 0, m, tau); /* the mean until the next tick, nearly */
    const gains_real norm = error(m, q, v, e);
    const int knot = last_before(task->begins, task->knots, late);
    const gains_real size = cost(n, task->costs + knot * (n * (n + 1) / 2), e);
    if (!isfinite(size) || !(10 * norm > 9 && 10 * norm < 11)) {
        told = GAINS_FAILED;
        state->failed++;
    } else if (size >= task->region[knot]) {
        told = GAINS_BEYOND;
        state->beyond++;
    }
    int cut = 0;
    const gains_real *row = task->gains + knot * m * n;
    for (int a = 0; a < m; a++, row += n) {
        for (int i = 0; i < n && told != GAINS_FAILED; i++) {
            tau[a] += row[i] * e[i];
        }
        const gains_real most = task->most_torque[a];
        cut |= tau[a] > most || tau[a] < -most;
        tau[a] = tau[a] > most ? most : tau[a] < -most ? -most : tau[a];
    }
    state->saturated += cut;
    return told + cut * GAINS_SATURATED;
}

/* Ticks compute a correction of the plan's torques from a measured state; torques between ticks. */

#include <float.h>
#include <math.h>
#include <string.h>

#include "mpc_layout.h"

static const double SAME = 1e-6 + 4096 * DBL_EPSILON; /* of a period: closer times count as equal */

static double *next(double **memory, int count)
{
    double *own = *memory;
    if (own != NULL) {
        *memory += count;
    }
    return own;
}

/* Place a tick's arrays behind the two corrections and return the size; with memory NULL only
   return the size. */
static int lay_out(const mpc_task *task, double *memory, mpc_workspace *w)
{
    const int m = task->tail, n = m * task->intervals, rows = 2 * n;
    const int x = states_of(task), y = x + MPC_TURN, z = x + m;
    const int ints = (3 * n + rows) * (int)sizeof(int), real = (int)sizeof(double);
    const int counts[] = {2 * n, x, x * n, x, x * n, x, x * n, rows, rows * n, y, y * z, m, z, n + x,
                          task->work, n, n * n, x, n, n, n, n, rows, n + rows, n + rows, n,
                          2 * n * (n + 2), (ints + real - 1) / real};
    mpc_motion *motion = &w->motion;
    mpc_bounded *qp = &w->qp;
    double *corrections, *set;
    double **arrays[] = {&corrections, &motion->x, &motion->S, &motion->x_at, &motion->S_at,
                         &motion->sum, &motion->S_sum, &motion->extreme, &motion->S_extreme,
                         &motion->y, &motion->J, &motion->tau, &motion->table, &motion->row,
                         &motion->work, &w->program.c, &w->program.R, &w->x0, &w->fresh, &w->trial,
                         &w->lower, &w->upper, &w->limit, &w->low, &w->high, &qp->d, &qp->memory,
                         &set};
    int sum = 0;
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
        *arrays[k] = next(&memory, counts[k]);
        sum += counts[k];
    }
    motion->task = task;
    motion->variables = qp->n = n;
    qp->rows = rows;
    qp->most = mpc_most_changes(n);
    qp->R = w->program.R;
    qp->c = w->program.c;
    qp->A = motion->S_extreme;
    qp->lower = w->low;
    qp->upper = w->high;
    qp->set = (int *)(void *)set;
    return sum;
}

size_t mpc_memory_size(const mpc_task *task)
{
    mpc_workspace w;
    return (size_t)lay_out(task, NULL, &w);
}

void mpc_begin(mpc_state *state, const mpc_task *task, double *memory)
{
    memset(memory, 0, mpc_memory_size(task) * sizeof *memory);
    state->task = task;
    state->memory = memory;
    state->tick = -1;
    state->ticks = state->failed = state->steps = state->trials = state->set_changes = 0;
    state->newest = 0;
    state->begin[0] = state->begin[1] = NONE;
    state->width[0] = state->width[1] = 1.0;
    state->off = 0.0;
    state->flags = 0;
    state->log = NULL;
    state->room = 0;
}

static double *correction_of(const mpc_state *state, int which)
{
    const mpc_task *task = state->task;
    return state->memory + (size_t)which * (size_t)(task->intervals * task->tail);
}

/* Return which correction acts at a time; -1: none yet. */
static int acting(const mpc_state *state, double clock)
{
    const double late = clock + SAME * state->task->period;
    if (state->begin[state->newest] <= late) {
        return state->newest;
    }
    return state->begin[1 - state->newest] <= late ? 1 - state->newest : -1;
}

/* Add to tau the correction that acts at t; only those known at the clock count. */
static void add_correction(const mpc_state *state, double clock, double t, double *tau)
{
    const mpc_task *task = state->task;
    const int which = acting(state, clock);
    if (which < 0) {
        return;
    }
    const double place = (t - state->begin[which]) / state->width[which];
    if (place < (double)task->intervals * (1.0 + SAME)) {
        int k = place > 0.0 ? (int)place : 0;
        k = k < task->intervals ? k : task->intervals - 1;
        const double *row = correction_of(state, which) + k * task->tail;
        for (int a = 0; a < task->tail; a++) {
            tau[a] += row[a];
        }
    }
}

void mpc_torque(const mpc_state *state, double clock, double t, double *tau)
{
    const mpc_task *task = state->task;
    const int over = t > task->end + SAME * task->period;
    mpc_planned(task, clock + SAME * task->period, t, 0, task->tail, tau);
    add_correction(state, clock, t, tau);
    for (int a = 0; a < task->tail; a++) {
        const double most = task->most_torque[a];
        tau[a] = over ? 0.0 : tau[a] > most ? most : tau[a] < -most ? -most : tau[a];
    }
}

/* Compute x0, with a quaternion of norm 1, and the angular momentum from q, v; return 0 if all
   numbers are finite. */
static int measured(mpc_workspace *w, const double *q, const double *v)
{
    const mpc_task *task = w->motion.task;
    const int m = task->tail;
    double linear[3], size = 0.0, sum = 0.0;
    for (int i = 0; i < MPC_ATTITUDE; i++) {
        size += q[3 + i] * q[3 + i];
    }
    if (!(size > 0.0)) {
        return 1;
    }
    size = sqrt(size);
    for (int i = 0; i < MPC_ATTITUDE; i++) {
        w->x0[i] = q[3 + i] / size;
    }
    memcpy(w->x0 + MPC_ATTITUDE, q + 7, (size_t)m * sizeof *q);
    memcpy(w->x0 + MPC_ATTITUDE + m, v + 6, (size_t)m * sizeof *v);
    const int failed = task->momentum(task->parameters, q, v, linear, w->motion.h, w->motion.work);
    for (int i = 0; i < states_of(task); i++) {
        sum += fabs(w->x0[i]);
    }
    sum += fabs(w->motion.h[0]) + fabs(w->motion.h[1]) + fabs(w->motion.h[2]);
    return failed || !isfinite(sum);
}

/* Move x0 to the end of the delay, under the torques that act until then; return 0 for success. */
static int foretell(const mpc_state *state, mpc_workspace *w, double t)
{
    const mpc_task *task = state->task;
    const size_t states = (size_t)states_of(task);
    memcpy(w->motion.x, w->x0, states * sizeof(double));
    for (int k = 0; k < task->late_steps; k++) {
        const double h = task->delay / (double)task->late_steps, at = t + (double)k * h;
        memset(w->trial, 0, (size_t)task->tail * sizeof(double));
        add_correction(state, t, at, w->trial);
        if (mpc_step(&w->motion, at, h, w->trial, 0, 0) != 0) {
            return 1;
        }
    }
    memcpy(w->x0, w->motion.x, states * sizeof(double));
    return 0;
}

/* Guess the new correction: the last one at the middle of each new interval, within bounds. */
static void write_guess(const mpc_state *state, mpc_workspace *w, double *correction)
{
    const mpc_task *task = state->task;
    memset(correction, 0, (size_t)w->motion.variables * sizeof(double));
    for (int j = 0; j < task->intervals; j++) {
        const double middle = w->motion.begin + ((double)j + 0.5) * w->motion.width;
        add_correction(state, w->motion.begin, middle, correction + j * task->tail);
    }
    for (int i = 0; i < w->motion.variables; i++) {
        correction[i] = mpc_between(correction[i], w->lower[i], w->upper[i]);
    }
}

/* Compute the state at which new torques act, their bounds and a first guess of the correction, which
   is stored in w->fresh; return 0 for success. */
static int prepared(const mpc_state *state, mpc_workspace *w, double t, const double *q,
                    const double *v)
{
    const mpc_task *task = state->task;
    mpc_motion *motion = &w->motion;
    if (measured(w, q, v) != 0 || foretell(state, w, t) != 0) {
        return 1;
    }
    const double rest = task->end - (t + task->delay);
    motion->begin = t + task->delay;
    motion->width = (rest < task->horizon ? rest : task->horizon) / (double)task->intervals;
    if (!(motion->width > 0.0)) {
        return 1;
    }
    mpc_write_bounds(w);
    write_guess(state, w, w->fresh);
    return 0;
}

/* Compute the correction from q, v at t and store it in w->fresh; return 0 for success. */
static int computed(mpc_state *state, mpc_workspace *w, double t, const double *q, const double *v)
{
    const mpc_task *task = state->task;
    if (prepared(state, w, t, q, v) != 0) {
        return 1;
    }
    int failed = mpc_improve(state, w, w->fresh), k = 1;
    if (failed == MPC_FAR && k++ < task->iterations) { /* again, without torques */
        for (int i = 0; i < w->motion.variables; i++) {
            w->fresh[i] = 0.5 * (w->lower[i] + w->upper[i]);
        }
        state->flags |= MPC_SECOND;
        failed = mpc_improve(state, w, w->fresh);
    }
    if (failed) {
        return 1;
    }
    while (k++ < task->iterations && (state->off > task->near || state->flags & MPC_BOUND)) {
        state->flags |= MPC_SECOND;
        if (mpc_improve(state, w, w->fresh) != 0) {
            break; /* it is the best */
        }
    }
    state->flags |= state->off > task->miss ? MPC_MISS : 0;
    return 0;
}

/* Note that a tick of these flags ended. */
static void note(mpc_state *state)
{
    if (state->ticks < state->room) {
        state->log[state->ticks] = (unsigned char)state->flags;
    }
    state->ticks++;
}

int mpc_tick(mpc_state *state, double t, const double *q, const double *v)
{
    mpc_workspace w;
    lay_out(state->task, state->memory, &w);
    state->flags = 0;
    if (computed(state, &w, t, q, v) != 0) {
        state->failed++;
        state->flags |= acting(state, t + state->task->delay) < 0 ? MPC_KEPT | MPC_OPEN : MPC_KEPT;
        note(state);
        return 1;
    }
    note(state);
    /* it replaces the correction that does not act now */
    const int place = acting(state, t) == state->newest ? 1 - state->newest : state->newest;
    memcpy(correction_of(state, place), w.fresh, (size_t)w.motion.variables * sizeof(double));
    state->begin[place] = w.motion.begin;
    state->width[place] = w.motion.width;
    state->newest = place;
    return 0;
}

void mpc_control(mpc_state *state, double clock, double t, const double *q, const double *v,
                 double *tau)
{
    const mpc_task *task = state->task;
    const double late = SAME * task->period;
    const long tick = (long)((clock + late) / task->period);
    if (tick > state->tick && clock <= task->last + late) {
        state->tick = tick;
        (void)mpc_tick(state, clock, q, v);
    }
    mpc_torque(state, clock, t, tau);
}

int mpc_simulated(void *context, double t, const double *q, const double *v, double *tau)
{
    mpc_simulation *run = context;
    const double clock = run->step_begin == NULL ? t : *run->step_begin - run->clock;
    mpc_control(&run->state, clock < t ? clock : t, t, q, v, tau);
    return 0;
}

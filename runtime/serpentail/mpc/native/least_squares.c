/* The sum of squares that a correction minimises, and its Gauss-Newton derivatives. */

#include <math.h>
#include <string.h>

#include "mpc_layout.h"

/* Add weight r^2 / 2; row (columns) is dr / d(correction). */
static void add_square(const mpc_motion *motion, mpc_program *program, double weight, double r,
                       const double *row, int columns)
{
    program->cost += 0.5 * weight * r * r;
    if (program->H == NULL) {
        return;
    }
    for (int i = 0; i < columns; i++) {
        const double factor = weight * row[i];
        double *own = program->H + (size_t)i * (size_t)motion->variables;
        program->g[i] += factor * r;
        for (int j = 0; j <= i; j++) {
            own[j] += factor * row[j];
        }
    }
}

static const double *slope_of(const mpc_motion *motion, int state)
{
    return motion->S + (size_t)state * (size_t)motion->variables;
}

/* Add the squares of the correction. */
static void add_torques(mpc_motion *motion, mpc_program *program)
{
    const mpc_task *task = motion->task;
    for (int i = 0; i < motion->variables; i++) {
        const double weight = motion->width * task->torque_weight[i % task->tail];
        program->cost += 0.5 * weight * motion->correction[i] * motion->correction[i];
        if (program->H != NULL) {
            program->g[i] += weight * motion->correction[i];
            program->H[(size_t)i * (size_t)motion->variables + (size_t)i] += weight;
        }
    }
}

/* Add the squares of the tail's rates minus the plan's, over a step of length h that ends at t. */
static void add_rates(mpc_motion *motion, mpc_program *program, double t, double h, int columns)
{
    const mpc_task *task = motion->task;
    const int m = task->tail, first = MPC_ATTITUDE + m;
    mpc_planned(task, t, t, m + first, m + first + m, motion->table);
    for (int a = 0; a < m; a++) {
        add_square(motion, program, h * task->rate_weight[a],
                   motion->x[first + a] - motion->table[a], slope_of(motion, first + a), columns);
    }
}

/* Add the squares of the excess of angles over their bounds. */
static void add_angles(mpc_motion *motion, mpc_program *program, int columns)
{
    const mpc_task *task = motion->task;
    for (int a = 0; a < task->tail; a++) {
        const double angle = motion->x[MPC_ATTITUDE + a], most = task->most_angle[a];
        const double beyond = angle > most ? angle - most : angle < -most ? angle + most : 0.0;
        if (beyond > 0.0 || beyond < 0.0) {
            add_square(motion, program, task->angle_weight, beyond,
                       slope_of(motion, MPC_ATTITUDE + a), columns);
        }
    }
}

/* Add the square of the rotation from a goal's attitude: twice the rows of goal times the
   quaternion. */
static void add_attitude(mpc_motion *motion, mpc_program *program, int rows, const double *goal)
{
    const int n = motion->variables;
    for (int r = 0; r < rows; r++, goal += MPC_ATTITUDE) {
        double turn = 0.0;
        for (int i = 0; i < n; i++) {
            motion->row[i] = 0.0;
        }
        for (int j = 0; j < MPC_ATTITUDE; j++) {
            const double factor = 2.0 * goal[j], *S = slope_of(motion, j);
            turn += factor * motion->x[j];
            for (int i = 0; program->H != NULL && i < n; i++) {
                motion->row[i] += factor * S[i];
            }
        }
        add_square(motion, program, motion->task->attitude_weight, turn, motion->row, n);
    }
}

/* Add the squares of omega minus the goal's, at the end of the plan; return 0 for success. */
static int add_turn(mpc_motion *motion, mpc_program *program, double t, const double *correction)
{
    const mpc_task *task = motion->task;
    const int m = task->tail, states = states_of(task), zeta = arguments_of(task);
    const int n = motion->variables;
    const double *weight = task->end_weight + 2 * m, *goal = task->end_state + 2 * m;
    if (!(weight[0] > 0.0 || weight[1] > 0.0 || weight[2] > 0.0)) {
        return 0;
    }
    if (mpc_node(motion, t, motion->x, correction, program->H != NULL) != 0) {
        return 1;
    }
    for (int r = 0; r < MPC_TURN; r++) {
        const double *J = motion->J + (size_t)(states + r) * (size_t)zeta;
        for (int i = 0; i < n; i++) {
            motion->row[i] = 0.0;
        }
        for (int j = 0; program->H != NULL && j < states; j++) {
            const double *S = slope_of(motion, j);
            for (int i = 0; i < n; i++) {
                motion->row[i] += J[j] * S[i];
            }
        }
        add_square(motion, program, weight[r], motion->y[states + r] - goal[r], motion->row, n);
    }
    return 0;
}

/* Add the squares of the errors at the end of the plan; return 0 for success. */
static int add_goal(mpc_motion *motion, mpc_program *program, double t, const double *correction)
{
    const mpc_task *task = motion->task;
    for (int i = 0; i < 2 * task->tail; i++) {
        add_square(motion, program, task->end_weight[i],
                   motion->x[MPC_ATTITUDE + i] - task->end_state[i],
                   slope_of(motion, MPC_ATTITUDE + i), motion->variables);
    }
    add_attitude(motion, program, task->goal_rows, task->goal);
    return add_turn(motion, program, t, correction);
}

/* Add the squares of the deviations from the plan at t, before its end. */
static void add_tracking(mpc_motion *motion, mpc_program *program, double t)
{
    const mpc_task *task = motion->task;
    const int m = task->tail;
    mpc_planned(task, t, t, m, channels_of(task), motion->table);
    const double *c = motion->table, w = c[0], x = c[1], y = c[2], z = c[3];
    const double goal[12] = {-x, w, z, -y, -y, -z, w, x, -z, y, -x, w};
    for (int i = 0; i < 2 * m; i++) {
        add_square(motion, program, task->track_weight[i],
                   motion->x[MPC_ATTITUDE + i] - c[MPC_ATTITUDE + i],
                   slope_of(motion, MPC_ATTITUDE + i), motion->variables);
    }
    add_attitude(motion, program, 3, goal);
}

static int add_end(mpc_motion *motion, mpc_program *program, double t)
{
    const mpc_task *task = motion->task;
    const double *last = motion->correction + (task->intervals - 1) * task->tail;
    if (t >= task->end - 1e-9 * task->end) {
        return add_goal(motion, program, t, last);
    }
    add_tracking(motion, program, t);
    return 0;
}

int mpc_program_of(mpc_motion *motion, const double *x0, mpc_program *program)
{
    const mpc_task *task = motion->task;
    const int m = task->tail, states = states_of(task), n = motion->variables;
    const double h = motion->width / task->steps;
    memcpy(motion->x, x0, (size_t)states * sizeof(double));
    program->cost = 0.0;
    if (program->H != NULL) {
        memset(motion->S, 0, (size_t)states * (size_t)n * sizeof(double));
        memset(program->g, 0, (size_t)n * sizeof(double));
        memset(program->H, 0, (size_t)n * (size_t)n * sizeof(double));
    }
    add_torques(motion, program);
    for (int j = 0; j < task->intervals; j++) {
        const int columns = program->H != NULL ? (j + 1) * m : 0;
        for (int i = 0; i < task->steps; i++) {
            const double t = motion->begin + j * motion->width + i * h;
            if (mpc_step(motion, t, h, motion->correction + j * m, j, columns) != 0) {
                return 1;
            }
            add_rates(motion, program, t + h, h, columns);
        }
        add_angles(motion, program, columns);
    }
    if (add_end(motion, program, motion->begin + task->intervals * motion->width) != 0) {
        return 1;
    }
    for (int i = 0; program->H != NULL && i < n; i++) {
        for (int j = 0; j < i; j++) {
            program->H[(size_t)j * (size_t)n + (size_t)i] =
                program->H[(size_t)i * (size_t)n + (size_t)j];
        }
    }
    return !isfinite(program->cost);
}

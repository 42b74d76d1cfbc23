/* The sum of squares that a correction minimises, its Gauss-Newton derivatives, and the largest
   angles and rates of the tail. */

#include <math.h>
#include <string.h>

#include "mpc_layout.h"

/* Write factor times the slope of a state to motion->row, or add it there. */
static void write_row(mpc_motion *motion, int state, double factor, int columns, int adds)
{
    const int states = states_of(motion->task);
    const double *S = motion->S + state;
    for (int c = 0; c < columns; c++, S += states) {
        motion->row[c] = (adds ? motion->row[c] : 0.0) + factor * *S;
    }
}

/* Add weight r^2 / 2; motion->row (columns) is dr / d(correction), and is lost: it is rotated into R,
   whose condition is the root of that of the normal equations. */
static void add_square(const mpc_motion *motion, mpc_program *program, double weight, double r,
                       int columns)
{
    const int n = motion->variables;
    const double unit = sqrt(weight);
    double *row = motion->row, left = unit * r;
    program->cost += 0.5 * weight * r * r;
    if (program->R == NULL) {
        return;
    }
    for (int i = 0; i < columns; i++) {
        row[i] *= unit;
    }
    for (int i = 0; i < columns; i++) {
        double *own = program->R + i * n, *c = program->c + i;
        double cosine, sine;
        own[i] = mpc_rotation(own[i], row[i], &cosine, &sine);
        for (int k = i + 1; k < columns; k++) {
            const double first = own[k];
            own[k] = cosine * first + sine * row[k];
            row[k] = cosine * row[k] - sine * first;
        }
        const double first = *c;
        *c = cosine * first + sine * left;
        left = cosine * left - sine * first;
    }
}

/* Add the square of a state minus value. */
static void add_state(mpc_motion *motion, mpc_program *program, double weight, int state,
                      double value, int columns)
{
    write_row(motion, state, 1.0, program->R != NULL ? columns : 0, 0);
    add_square(motion, program, weight, motion->x[state] - value, columns);
}

/* Add the squares of the correction. */
static void add_torques(mpc_motion *motion, mpc_program *program)
{
    const mpc_task *task = motion->task;
    for (int i = 0; i < motion->variables; i++) {
        const double weight = motion->width * task->torque_weight[i % task->tail];
        program->cost += 0.5 * weight * motion->correction[i] * motion->correction[i];
        if (program->R != NULL) {
            program->R[i * motion->variables + i] = sqrt(weight);
            program->c[i] = sqrt(weight) * motion->correction[i];
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
        add_state(motion, program, h * task->rate_weight[a], first + a, motion->table[a], columns);
    }
}

/* Note the angles and rates that come nearest to their bounds in interval j, which a step ends. */
static void note_extremes(mpc_motion *motion, const mpc_program *program, int j, int first)
{
    const mpc_task *task = motion->task;
    const int both = 2 * task->tail, n = motion->variables;
    const int columns = program->R != NULL ? (j + 1) * task->tail : 0;
    for (int a = 0; a < both; a++) {
        const double value = motion->x[MPC_ATTITUDE + a];
        double *extreme = motion->extreme + j * both + a;
        if (first || (task->most_tail[a] < NONE && fabs(value) > fabs(*extreme))) {
            double *slope = motion->S_extreme + (j * both + a) * n;
            *extreme = value;
            write_row(motion, MPC_ATTITUDE + a, 1.0, columns, 0);
            memcpy(slope, motion->row, (size_t)columns * sizeof(double));
        }
    }
}

/* Add the square of the rotation from a goal's attitude: twice the rows of goal times the
   quaternion. */
static void add_attitude(mpc_motion *motion, mpc_program *program, int rows, const double *goal)
{
    const int columns = program->R != NULL ? motion->variables : 0;
    for (int r = 0; r < rows; r++, goal += MPC_ATTITUDE) {
        double turn = 0.0;
        for (int j = 0; j < MPC_ATTITUDE; j++) {
            turn += 2.0 * goal[j] * motion->x[j];
            write_row(motion, j, 2.0 * goal[j], columns, j > 0);
        }
        add_square(motion, program, motion->task->attitude_weight, turn, columns);
    }
}

/* Add the squares of omega minus the goal's, at the end of the plan; return 0 for success. */
static int add_turn(mpc_motion *motion, mpc_program *program, double t, const double *correction)
{
    const mpc_task *task = motion->task;
    const int m = task->tail, states = states_of(task), zeta = arguments_of(task);
    const int columns = program->R != NULL ? motion->variables : 0;
    const double *weight = task->end_weight + 2 * m, *goal = task->end_state + 2 * m;
    if (!(weight[0] > 0.0 || weight[1] > 0.0 || weight[2] > 0.0)) {
        return 0;
    }
    if (mpc_node(motion, t, motion->x, correction, program->R != NULL) != 0) {
        return 1;
    }
    for (int r = 0; r < MPC_TURN; r++) {
        const double *J = motion->J + (states + r) * zeta;
        for (int j = 0; columns > 0 && j < states; j++) {
            write_row(motion, j, J[j], columns, j > 0);
        }
        add_square(motion, program, weight[r], motion->y[states + r] - goal[r], columns);
    }
    return 0;
}

/* Add the squares of the errors at the end of the plan; return 0 for success. */
static int add_goal(mpc_motion *motion, mpc_program *program, double t, const double *correction)
{
    const mpc_task *task = motion->task;
    for (int i = 0; i < 2 * task->tail; i++) {
        if (task->end_weight[i] > 0.0) {
            add_state(motion, program, task->end_weight[i], MPC_ATTITUDE + i, task->end_state[i],
                      motion->variables);
        }
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
        add_state(motion, program, task->track_weight[i], MPC_ATTITUDE + i, c[MPC_ATTITUDE + i],
                  motion->variables);
    }
    add_attitude(motion, program, 3, goal);
}

/* Add the squares of the errors at the end of the horizon, t; return 0 for success. */
static int add_end(mpc_motion *motion, mpc_program *program, double t)
{
    const mpc_task *task = motion->task;
    const double *last = motion->correction + (task->intervals - 1) * task->tail;
    const double before = program->cost;
    int failed = 0;
    if (t >= task->end - 1e-6 * task->end) {
        failed = add_goal(motion, program, t, last);
    } else {
        add_tracking(motion, program, t);
    }
    program->off = 2.0 * (program->cost - before);
    return failed;
}

int mpc_program_of(mpc_motion *motion, const double *x0, mpc_program *program)
{
    const mpc_task *task = motion->task;
    const int m = task->tail, states = states_of(task), n = motion->variables;
    const double h = motion->width / (double)task->steps;
    memcpy(motion->x, x0, (size_t)states * sizeof(double));
    program->cost = 0.0;
    if (program->R != NULL) {
        memset(motion->S, 0, (size_t)(states * n) * sizeof(double));
        memset(motion->S_extreme, 0, (size_t)(2 * m * task->intervals * n) * sizeof(double));
        memset(program->c, 0, (size_t)n * sizeof(double));
        memset(program->R, 0, (size_t)(n * n) * sizeof(double));
    }
    add_torques(motion, program);
    for (int j = 0; j < task->intervals; j++) {
        const int columns = program->R != NULL ? (j + 1) * m : 0;
        for (int i = 0; i < task->steps; i++) {
            const double t = motion->begin + (double)j * motion->width + (double)i * h;
            if (mpc_step(motion, t, h, motion->correction + j * m, j, columns) != 0) {
                return 1;
            }
            add_rates(motion, program, t + h, h, columns);
            note_extremes(motion, program, j, i == 0);
        }
    }
    if (add_end(motion, program, motion->begin + (double)task->intervals * motion->width) != 0) {
        return 1;
    }
    return !isfinite(program->cost);
}

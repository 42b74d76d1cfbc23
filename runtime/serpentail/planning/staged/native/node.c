/* A node in the program's units, its joints damped. */

#include "stage_layout.h"

/* The unit of entry i of y. */
static double unit_of_y(const Task *task, int i)
{
    const int states = ATTITUDE + 2 * task->tail;
    return i < states ? task->state_unit[i] : task->turn_unit[i - states];
}

/* The unit of entry j of zeta = (state, torque). */
static double unit_of_zeta(const Task *task, int j)
{
    const int states = ATTITUDE + 2 * task->tail;
    return j < states ? task->state_unit[j] : task->torque_unit[j - states];
}

/* Columns of torques enter those of rates: the torque in truth is tau - damping q_t_dot. */
static void damp_columns(const Task *task, double *rows, int count)
{
    const int m = task->tail, rates = ATTITUDE + m, zeta = ATTITUDE + 3 * m;
    for (int i = 0; i < count; i++) {
        double *row = rows + (size_t)i * zeta;
        for (int a = 0; a < m; a++) {
            row[rates + a] -= task->damping * row[rates + m + a];
        }
    }
}

static void damp_rows(const Task *task, double *H)
{
    const int m = task->tail, rates = ATTITUDE + m, zeta = ATTITUDE + 3 * m;
    for (int a = 0; a < m; a++) {
        double *rate = H + (size_t)(rates + a) * zeta, *torque = rate + (size_t)m * zeta;
        for (int j = 0; j < zeta; j++) {
            rate[j] -= task->damping * torque[j];
        }
    }
}

static void scale_y(const Task *task, double *y)
{
    for (int i = 0; i < size_of_y(task); i++) {
        y[i] /= unit_of_y(task, i);
    }
}

static void scale_J(const Task *task, double *J)
{
    const int size = size_of_y(task), zeta = size_of_zeta(task);
    damp_columns(task, J, size);
    for (int i = 0; i < size; i++) {
        for (int j = 0; j < zeta; j++) {
            J[(size_t)i * zeta + j] *= unit_of_zeta(task, j) / unit_of_y(task, i);
        }
    }
}

static void scale_H(const Task *task, double *H)
{
    const int zeta = size_of_zeta(task);
    damp_columns(task, H, zeta);
    damp_rows(task, H);
    for (int i = 0; i < zeta; i++) {
        for (int j = 0; j < zeta; j++) {
            H[(size_t)i * zeta + j] *= unit_of_zeta(task, i) * unit_of_zeta(task, j);
        }
    }
}

size_t node_scratch(const Task *task)
{
    return (size_t)(size_of_zeta(task) + size_of_y(task) + task->work);
}

/* (x, tau) in SI. */
static void in_si(const Task *task, const double *x, const double *torque, double *zeta)
{
    const int m = task->tail, states = states_of(task);
    for (int j = 0; j < states; j++) {
        zeta[j] = task->state_unit[j] * x[j];
    }
    for (int a = 0; a < m; a++) {
        zeta[states + a] = task->torque_unit[a] * torque[a]
                         - task->damping * zeta[ATTITUDE + m + a];
    }
}

int node_rates(const Task *task, const double *x, const double *torque, double *y,
               double *scratch)
{
    const double *tau = scratch + states_of(task);
    double *work = scratch + size_of_zeta(task) + size_of_y(task);
    in_si(task, x, torque, scratch);
    const int failed = task->rates(task->parameters, scratch, tau, task->momentum, y, work);
    scale_y(task, y);
    return failed;
}

int node_slopes(const Task *task, const double *x, const double *torque, double *y, double *J,
                double *scratch)
{
    const double *tau = scratch + states_of(task);
    double *work = scratch + size_of_zeta(task) + size_of_y(task);
    in_si(task, x, torque, scratch);
    const int failed = task->slopes(task->parameters, scratch, tau, task->momentum, y, J, work);
    scale_y(task, y);
    scale_J(task, J);
    return failed;
}

int node_curvature(const Task *task, const double *x, const double *torque, const double *mu,
                   double *y, double *J, double *H, double *scratch)
{
    const double *tau = scratch + states_of(task);
    double *weights = scratch + size_of_zeta(task), *work = weights + size_of_y(task);
    in_si(task, x, torque, scratch);
    for (int i = 0; i < size_of_y(task); i++) {
        weights[i] = mu[i] / unit_of_y(task, i);
    }
    const int failed = task->curvature(task->parameters, scratch, tau, task->momentum, weights, y,
                                       J, H, work);
    scale_y(task, y);
    scale_J(task, J);
    scale_H(task, H);
    return failed;
}

/* What a node costs: a sum over the tail's coordinates, each by its torque and its rate alone. */

#include <math.h>

#include "stage.h"

/* value, slopes by torque and rate, and curvatures, in SI */
typedef struct {
    double value, by_torque, by_rate, twice_torque, mixed, twice_rate;
} Cost;

/* tau^2 + (smoothing q_t_dot)^2 */
static Cost effort(const Task *task, double torque, double rate)
{
    const double c = task->smoothing * task->smoothing;
    Cost cost = {torque * torque + c * rate * rate, 2 * torque, 2 * c * rate, 2.0, 0.0, 2 * c};
    return cost;
}

/* sqrt(power^2 + softening^2) - softening */
static Cost energy(const Task *task, double torque, double rate)
{
    const double s = task->softening, power = torque * rate, soft = hypot(power, s);
    const double slope = power / soft, bend = s * s / (soft * soft * soft);
    Cost cost = {soft - s, slope * rate, slope * torque, bend * rate * rate,
                 bend * power + slope, bend * torque * torque};
    return cost;
}

double cost_of(const Task *task, const double *torque, const double *rate, double *slope,
               double *curvature)
{
    const int m = task->tail;
    const double *rate_unit = task->state_unit + ATTITUDE + m;
    double sum = 0.0;
    for (int a = 0; a < m; a++) {
        const double t = task->torque_unit[a], v = rate_unit[a];
        const Cost cost = (task->cost == ENERGY ? energy : effort)(task, t * torque[a],
                                                                   v * rate[a]);
        sum += cost.value / task->cost_unit;
        if (slope != NULL) {
            slope[a] = cost.by_torque * t / task->cost_unit;
            slope[m + a] = cost.by_rate * v / task->cost_unit;
        }
        if (curvature != NULL) {
            curvature[a] = cost.twice_torque * t * t / task->cost_unit;
            curvature[m + a] = cost.mixed * t * v / task->cost_unit;
            curvature[2 * m + a] = cost.twice_rate * v * v / task->cost_unit;
        }
    }
    return sum;
}

/* Exact directional derivatives of flights, by the model's kinematics and the Jacobians of its accelerations. */

#include "fmu-unit.h"

#if !POINTS

/* A direction of states in the tangent space of q, torso axes turned in the torso's frame: 2 conj(a) b / |a|^2. */
static void tangent(const double *q, const double *along, double *out)
{
  const double *a = q + 3, *b = along + 3;
  const double scale = 2 / (a[0] * a[0] + a[1] * a[1] + a[2] * a[2] + a[3] * a[3]);
  memcpy(out, along, 3 * sizeof(double));
  out[3] = scale * (a[0] * b[1] - a[1] * b[0] - a[2] * b[3] + a[3] * b[2]);
  out[4] = scale * (a[0] * b[2] + a[1] * b[3] - a[2] * b[0] - a[3] * b[1]);
  out[5] = scale * (a[0] * b[3] - a[1] * b[2] + a[2] * b[1] - a[3] * b[0]);
  memcpy(out + 6, along + 7, NT * sizeof(double));
}

/* out += A x, A of NV rows. */
static void add_product(const double *A, const double *x, size_t columns, double *out)
{
  for (size_t row = 0; row < NV; ++row) {
    for (size_t column = 0; column < columns; ++column) {
      out[row] += A[row * columns + column] * x[column];
    }
  }
}

/* Compute the change of the rates along a change of states and torques; return 0 for success. */
static int rate_along(Instance *unit, const double *along, const double *torques, double *out)
{
  const double *q = unit->now.x, *v = q + NQ;
  double dq[NV * NV], dv[NV * NV], dtau[NV * NT], change[NV], of_q[NQ], of_v[NQ];
  const int status = MODEL(forward_dynamics_derivatives)(&unit->now.parameters, q, v, unit->now.u, dq, dv, dtau,
                                                         unit->work);
  /* q_dot is linear in q, whose quaternion alone counts, and in v */
  MODEL(configuration_rate)(along, v, of_q);
  MODEL(configuration_rate)(q, along + NQ, of_v);
  for (int k = 0; k < NQ; ++k) {
    out[k] = of_v[k] + (k >= 3 && k < 7 ? of_q[k] : 0);
  }
  memset(out + NQ, 0, NV * sizeof(double));
  tangent(q, along, change);
  add_product(dq, change, NV, out + NQ);
  add_product(dv, along + NQ, NV, out + NQ);
  add_product(dtau, torques, NT, out + NQ);
  return status;
}

#endif

FMI(fmi2Status, GetDirectionalDerivative)(fmi2Component c, const fmi2ValueReference unknowns[], size_t n,
                                          const fmi2ValueReference knowns[], size_t m, const fmi2Real along[],
                                          fmi2Real out[])
{
#if POINTS
  (void)unknowns, (void)n, (void)knowns, (void)m, (void)along, (void)out;
  return told(c, fmi2Error, "directional derivatives: not available for a model with contacts");
#else
  Instance *unit = c;
  /* derivatives of states and their rates, with respect to states and torques */
  double all[2 * NX], torques[NT];
  memset(all, 0, sizeof all);
  memset(torques, 0, sizeof torques);
  for (size_t k = 0; k < m; ++k) {
    if (knowns[k] < DERIVATIVES) {
      all[knowns[k]] += along[k];
    } else if (knowns[k] >= INPUTS && knowns[k] < PARAMETERS) {
      torques[knowns[k] - INPUTS] += along[k];
    } else {
      return told(unit, fmi2Error, "vKnown: needs states or torques");
    }
  }
  if (rate_along(unit, all, torques, all + NX) != 0) {
    return told(unit, fmi2Discard, "no derivatives: a state, torque or parameter is not finite or not physical");
  }
  for (size_t k = 0; k < n; ++k) {
    if (unknowns[k] >= INPUTS) {
      return told(unit, fmi2Error, "vUnknown: needs states or their derivatives");
    }
    out[k] = all[unknowns[k]];
  }
  return fmi2OK;
#endif
}

/* The motion of a unit, by the environment's integrator or by the model's own. */

#include "fmu-unit.h"

/* The additional argument of functions of a model with legs. */
#if LEGS
#define LEGS_OF(u) (u) + NT,
#else
#define LEGS_OF(u)
#endif

static const long MOST_STEPS = 1000000; /* in one step of co-simulation */

fmi2Status known_rate(Instance *unit)
{
  const double *q = unit->now.x, *v = q + NQ;
  if (unit->known) {
    return fmi2OK;
  }
#if POINTS
  double forces[3 * POINTS];
  const int status = MODEL(contact_dynamics)(&unit->now.parameters, q, v, unit->now.u, v + NV, LEGS_OF(unit->now.u)
                                             unit->rate + NQ, unit->rate + NQ + NV, forces, unit->work);
#else
  const int status = MODEL(forward_dynamics)(&unit->now.parameters, q, v, unit->now.u, unit->rate + NQ, unit->work);
#endif
  if (status != 0) {
    return told(unit, fmi2Discard, "no accelerations: a state, input or parameter is not finite or not physical");
  }
  MODEL(configuration_rate)(q, v, unit->rate);
  unit->known = 1;
  return fmi2OK;
}

/* Model exchange. */

FMI(fmi2Status, EnterEventMode)(fmi2Component c) { return (void)c, fmi2OK; }
FMI(fmi2Status, EnterContinuousTimeMode)(fmi2Component c) { return (void)c, fmi2OK; }

FMI(fmi2Status, NewDiscreteStates)(fmi2Component c, fmi2EventInfo *info)
{
  (void)c;
  memset(info, 0, sizeof *info);
  return fmi2OK;
}

FMI(fmi2Status, CompletedIntegratorStep)(fmi2Component c, fmi2Boolean no_set, fmi2Boolean *event, fmi2Boolean *end)
{
  (void)c, (void)no_set;
  *event = *end = 0;
  return fmi2OK;
}

FMI(fmi2Status, SetTime)(fmi2Component c, fmi2Real time)
{
  ((Instance *)c)->now.t = time;
  return fmi2OK;
}

FMI(fmi2Status, SetContinuousStates)(fmi2Component c, const fmi2Real x[], size_t n)
{
  Instance *unit = c;
  if (n != NX) {
    return told(unit, fmi2Error, "nx: needs the number of states");
  }
  memcpy(unit->now.x, x, sizeof unit->now.x);
  unit->known = 0;
  return fmi2OK;
}

FMI(fmi2Status, GetContinuousStates)(fmi2Component c, fmi2Real x[], size_t n)
{
  Instance *unit = c;
  if (n != NX) {
    return told(unit, fmi2Error, "nx: needs the number of states");
  }
  memcpy(x, unit->now.x, sizeof unit->now.x);
  return fmi2OK;
}

FMI(fmi2Status, GetDerivatives)(fmi2Component c, fmi2Real rate[], size_t n)
{
  Instance *unit = c;
  if (n != NX) {
    return told(unit, fmi2Error, "nx: needs the number of states");
  }
  const fmi2Status status = known_rate(unit);
  if (status == fmi2OK) {
    memcpy(rate, unit->rate, sizeof unit->rate);
  }
  return status;
}

FMI(fmi2Status, GetEventIndicators)(fmi2Component c, fmi2Real indicators[], size_t n)
{
  Instance *unit = c;
  if (n != POINTS) {
    return told(unit, fmi2Error, "ni: needs the number of points that can touch the ground");
  }
#if POINTS
  double places[3 * POINTS], velocities[3 * POINTS];
  const double *q = unit->now.x;
  if (MODEL(contact_points)(&unit->now.parameters, q, q + NQ, LEGS_OF(unit->now.u) places, velocities, unit->work) != 0) {
    return told(unit, fmi2Discard, "no points: a state, input or parameter is not finite");
  }
  for (int k = 0; k < POINTS; ++k) {
    indicators[k] = places[3 * k + 2];
  }
#else
  (void)indicators;
#endif
  return fmi2OK;
}

FMI(fmi2Status, GetNominalsOfContinuousStates)(fmi2Component c, fmi2Real nominals[], size_t n)
{
  (void)c;
  for (size_t k = 0; k < n; ++k) {
    nominals[k] = 1;
  }
  return fmi2OK;
}

/* Co-simulation. */

FMI(fmi2Status, DoStep)(fmi2Component c, fmi2Real t, fmi2Real step, fmi2Boolean no_set)
{
  Instance *unit = c;
  State *now = &unit->now;
  (void)no_set;
  if (!(step > 0 && t + step > t)) {
    return told(unit, fmi2Error, "communicationStepSize: needs a time above 0 that moves the clock");
  }
  /* torques are constant during the step */
  const double times[2] = {t, t + step};
  const MODEL(piecewise) held = {1, NT, 0, times, now->u};
  const MODEL(controller) controller = {.torques = &held};
  MODEL(drive) drive = {.phases = 1, .begins = times, .controllers = &controller};
#if LEGS
  double moves[LEGS];
  for (int k = 0; k < 4; ++k) { /* an angle and its rate for each */
    moves[2 * k] = now->u[NT + k];
    moves[2 * k + 1] = now->u[NT + 4 + k];
  }
  const MODEL(piecewise) legs = {1, 4, 1, times, moves};
  drive.legs = &legs;
#endif
  /* samples at both ends of the step */
  double state[NX], q[2 * NQ], v[2 * NV], tau[2 * NT];
  memcpy(state, now->x, sizeof state);
  MODEL(run) run = {
    .parameters = &now->parameters, .drive = &drive, .t = t, .q = state, .v = state + NQ, .method = METHOD,
    .rtol = now->tolerance, .atol = now->tolerance, .most_step = step, .most_steps = MOST_STEPS,
    .pause = MOST_STEPS, .samples = 2, .times = times, .q_out = q, .v_out = v, .tau_out = tau, .work = unit->work,
  };
#if POINTS
  double bristles[4 * POINTS];
  run.bristles = state + NQ + NV;
  run.bristles_out = bristles;
#endif
  if (MODEL(rollout)(&run) != 0) {
    return told(unit, fmi2Error, "the motion cannot go on: is a torque too large, or the tolerance too small?");
  }
  memcpy(now->x, state, sizeof state);
  now->t = t + step;
  unit->known = 0;
  return fmi2OK;
}

FMI(fmi2Status, CancelStep)(fmi2Component c) { return told(c, fmi2Error, "a step that has ended cannot be cancelled"); }

FMI(fmi2Status, SetRealInputDerivatives)(fmi2Component c, const fmi2ValueReference references[], size_t n,
                                         const fmi2Integer orders[], const fmi2Real values[])
{
  (void)references, (void)orders, (void)values;
  return n == 0 ? fmi2OK : told(c, fmi2Error, "torques are held over a step: they have no derivatives");
}

FMI(fmi2Status, GetRealOutputDerivatives)(fmi2Component c, const fmi2ValueReference references[], size_t n,
                                          const fmi2Integer orders[], fmi2Real values[])
{
  (void)references, (void)orders, (void)values;
  return n == 0 ? fmi2OK : told(c, fmi2Error, "derivatives of outputs are variables: der(...)");
}

FMI(fmi2Status, GetRealStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
  *value = ((Instance *)c)->now.t;
  return kind == fmi2LastSuccessfulTime ? fmi2OK : fmi2Discard;
}

/* A step ends before DoStep returns, so no step is ever pending. */
#define NO_STATUS(Name, type)                                                              \
  FMI(fmi2Status, Name)(fmi2Component c, const fmi2StatusKind kind, type *value)           \
  {                                                                                        \
    (void)c, (void)kind, (void)value;                                                      \
    return fmi2Discard;                                                                    \
  }
NO_STATUS(GetStatus, fmi2Status)
NO_STATUS(GetIntegerStatus, fmi2Integer)
NO_STATUS(GetBooleanStatus, fmi2Boolean)
NO_STATUS(GetStringStatus, fmi2String)

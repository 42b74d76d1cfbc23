/* Creation and end of a unit, its variables and its states. */

#include <stdlib.h>

#include "fmu-unit.h"

fmi2Status told(const Instance *unit, fmi2Status status, const char *message)
{
  if (unit->callbacks.logger != NULL) {
    unit->callbacks.logger(unit->callbacks.environment, unit->name, status, "logStatusError", message);
  }
  return status;
}

static void start(State *now)
{
  memset(now, 0, sizeof *now);
  now->x[2] = HEIGHT;
  now->x[3] = 1; /* upright */
  memcpy(&now->parameters, VALUES, NP * sizeof(double));
  now->tolerance = TOLERANCE;
}

/* Return the address of a variable that may be set; NULL for the others. */
static double *place(State *now, fmi2ValueReference reference)
{
  if (reference < DERIVATIVES) {
    return now->x + reference;
  }
  if (reference < INPUTS || reference >= END) {
    return NULL;
  }
  return reference < PARAMETERS ? now->u + (reference - INPUTS) : (double *)&now->parameters + (reference - PARAMETERS);
}

/* Creation and end of an instance. */

FMI(const char *, GetTypesPlatform)(void) { return "default"; }
FMI(const char *, GetVersion)(void) { return "2.0"; }

FMI(fmi2Component, Instantiate)(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging)
{
  Instance *unit = calloc(1, sizeof *unit);
  (void)type, (void)resources, (void)visible, (void)logging;
  if (unit == NULL) {
    return NULL;
  }
  if (callbacks != NULL) {
    unit->callbacks = *callbacks;
  }
  unit->name = calloc(strlen(name) + 1, 1);
  if (unit->name != NULL) {
    strcpy(unit->name, name);
  }
  if (unit->name == NULL || strcmp(guid, GUID) != 0) {
    told(unit, fmi2Error, "the GUID is not that of modelDescription.xml: take both from one FMU");
    free(unit->name);
    free(unit);
    return NULL;
  }
  start(&unit->now);
  return unit;
}

FMI(void, FreeInstance)(fmi2Component c)
{
  if (c != NULL) {
    free(((Instance *)c)->name);
    free(c);
  }
}

FMI(fmi2Status, SetDebugLogging)(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
{
  (void)c, (void)on, (void)n, (void)categories;
  return fmi2OK;
}

FMI(fmi2Status, SetupExperiment)(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real begin,
                                 fmi2Boolean has_end, fmi2Real end)
{
  Instance *unit = c;
  (void)has_end, (void)end;
  if (has_tolerance && !(tolerance > 0)) {
    return told(unit, fmi2Error, "tolerance: needs a number above 0");
  }
  unit->now.tolerance = has_tolerance ? tolerance : TOLERANCE;
  unit->now.t = begin;
  return fmi2OK;
}

FMI(fmi2Status, EnterInitializationMode)(fmi2Component c) { return (void)c, fmi2OK; }
FMI(fmi2Status, ExitInitializationMode)(fmi2Component c) { return (void)c, fmi2OK; }
FMI(fmi2Status, Terminate)(fmi2Component c) { return (void)c, fmi2OK; }

FMI(fmi2Status, Reset)(fmi2Component c)
{
  Instance *unit = c;
  start(&unit->now);
  unit->known = 0;
  return fmi2OK;
}

/* Variables. */

FMI(fmi2Status, GetReal)(fmi2Component c, const fmi2ValueReference references[], size_t n, fmi2Real values[])
{
  Instance *unit = c;
  for (size_t k = 0; k < n; ++k) {
    const fmi2ValueReference reference = references[k];
    const double *at = place(&unit->now, reference);
    if (at == NULL && reference >= END) {
      return told(unit, fmi2Error, "value reference: needs one of modelDescription.xml");
    }
    if (at == NULL) {
      const fmi2Status status = known_rate(unit);
      if (status != fmi2OK) {
        return status;
      }
      at = unit->rate + (reference - DERIVATIVES);
    }
    values[k] = *at;
  }
  return fmi2OK;
}

FMI(fmi2Status, SetReal)(fmi2Component c, const fmi2ValueReference references[], size_t n, const fmi2Real values[])
{
  Instance *unit = c;
  unit->known = 0;
  for (size_t k = 0; k < n; ++k) {
    double *at = place(&unit->now, references[k]);
    if (at == NULL) {
      return told(unit, fmi2Error, "value reference: needs that of a state, an input or a parameter");
    }
    *at = values[k];
  }
  return fmi2OK;
}

/* All variables are real; the other types have none. */
#define NONE(Type)                                                                                                   \
  FMI(fmi2Status, Get##Type)(fmi2Component c, const fmi2ValueReference references[], size_t n, fmi2##Type values[])  \
  {                                                                                                                  \
    (void)references, (void)values;                                                                                  \
    return n == 0 ? fmi2OK : told(c, fmi2Error, "value reference: all variables are Real");                          \
  }                                                                                                                  \
  FMI(fmi2Status, Set##Type)(fmi2Component c, const fmi2ValueReference references[], size_t n,                       \
                             const fmi2##Type values[])                                                              \
  {                                                                                                                  \
    (void)references, (void)values;                                                                                  \
    return n == 0 ? fmi2OK : told(c, fmi2Error, "value reference: all variables are Real");                          \
  }
NONE(Integer)
NONE(Boolean)
NONE(String)

/* States of the unit. */

/* Copy a state into a kept one, which is allocated on first use. */
static fmi2Status kept(const Instance *unit, const void *from, fmi2FMUstate *state)
{
  if (*state == NULL) {
    *state = malloc(sizeof(State));
  }
  if (*state == NULL) {
    return told(unit, fmi2Error, "no memory for an FMU state");
  }
  memcpy(*state, from, sizeof(State));
  return fmi2OK;
}

FMI(fmi2Status, GetFMUstate)(fmi2Component c, fmi2FMUstate *state)
{
  return kept(c, &((Instance *)c)->now, state);
}

FMI(fmi2Status, SetFMUstate)(fmi2Component c, fmi2FMUstate state)
{
  Instance *unit = c;
  memcpy(&unit->now, state, sizeof(State));
  unit->known = 0;
  return fmi2OK;
}

FMI(fmi2Status, FreeFMUstate)(fmi2Component c, fmi2FMUstate *state)
{
  (void)c;
  free(*state);
  *state = NULL;
  return fmi2OK;
}

FMI(fmi2Status, SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate state, size_t *size)
{
  (void)c, (void)state;
  *size = sizeof(State);
  return fmi2OK;
}

FMI(fmi2Status, SerializeFMUstate)(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
  if (size < sizeof(State)) {
    return told(c, fmi2Error, "size: needs that of fmi2SerializedFMUstateSize");
  }
  memcpy(bytes, state, sizeof(State));
  return fmi2OK;
}

FMI(fmi2Status, DeSerializeFMUstate)(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
  if (size != sizeof(State)) {
    return told(c, fmi2Error, "size: needs that of fmi2SerializedFMUstateSize");
  }
  return kept(c, bytes, state);
}

/* A model as a functional mock-up unit: declarations that its files share.

   States x = (q, v, bristles) are also outputs.  Inputs are the torques, held over a step of
   co-simulation, and with feet the legs: four angles, which go on at their four rates.  Value
   references count x, its derivative, inputs, parameters, in this order.  the-model.h names the model,
   its sizes and the values at the start.  An instance belongs to one thread at a time. */
#ifndef SERPENTAIL_FMU_H
#define SERPENTAIL_FMU_H

#include <string.h>

#include "fmi-2.h"
#include "the-model.h"

enum { NX = NQ + NV + 2 * POINTS, NU = NT + LEGS };
enum { DERIVATIVES = NX, INPUTS = 2 * NX, PARAMETERS = INPUTS + NU, END = PARAMETERS + NP };

/* An FMU state: only numbers, so that its bytes can be stored. */
typedef struct {
  double t, x[NX], u[NU];
  MODEL(parameters) parameters; /* as NP numbers */
  double tolerance;
} State;

typedef struct {
  State now;
  double rate[NX];
  int known; /* 1 if rate belongs to the present state */
  fmi2CallbackFunctions callbacks;
  char *name;
  double work[WORK + 1];
} Instance;

/* Report a message to the environment, and return the status. */
fmi2Status MODEL(fmu_told)(const Instance *unit, fmi2Status status, const char *message);
#define told MODEL(fmu_told)

/* Compute the rates of the states; fmi2Discard if they cannot be computed. */
fmi2Status MODEL(fmu_known)(Instance *unit);
#define known_rate MODEL(fmu_known)

#endif

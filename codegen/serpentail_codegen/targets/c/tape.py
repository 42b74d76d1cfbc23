"""The record of a run's tape, along which derivatives of the run are taken."""

from .fields import Field, fields
from .simulation_features import SimulationFeatures

TAPE = fields("""
    long pause: largest number of steps in one call
    long room: length of the arrays of nodes
    long nodes: nodes so far: the start, then the end of each step
    real *times: [room] times (s)
    real *states: [room][STATE] q, v and bristles
    real *rates: [room][STATE] their rates
    real *untils: [room] ends of the smooth parts (s)
    int *kinds: [room] what moves a node: 0 those around it, 1 its own time, 2 a touch, 3 the
      landing
    real *state: [STATE] gradient by the end, then by the start
    real *by_parameters: [PARAMETERS] gradient by the parameters
    real *by_times: [room] gradients by the times of nodes
    long row: rows so far
    real *rows: [7 room][ROW] t, until, tail rates; gradients by torques and legs there
    long step: number of the step that is computed again
    real largest: largest gradient by q and v at a node
""")
TAPE_OF_CONTACTS = fields("""
    real *ties: [room][CONTACTS][3] weights of the margins whose zero moves a node
    real *sides: [room][CONTACTS][2] of each step: positive where a point presses, and where it
      slides
    int *sunk: [room] whether a point is in the ground at an end of each step
    real touched: last time (s) at which a point touched the ground
""")
TAPE_OF_LEGS = fields("""
    real landed_at: time at which the legs' landing begins (s)
    real by_landing: gradient by this time
""")


def tape_fields(has: SimulationFeatures) -> list[Field]:
    """Return the members of the record of a tape."""
    contacts = TAPE_OF_CONTACTS if has.contacts else []
    return TAPE + contacts + (TAPE_OF_LEGS if has.legs else [])

"""The records of a simulation: C structs that the caller fills in, and that hold its state between
calls.

One table lists the members of each record, with their C types and meanings. The header's structs
and the manifest's list of members follow from it; the runtime builds the same structs from the
manifest.
"""

import re
from collections.abc import Sequence

from .fields import Field, fields
from .simulation_features import SimulationFeatures

TYPES = r"\b(real|piecewise|controller|drive|parameters|torque)\b"  # that get the model's prefix


def records(has: SimulationFeatures) -> dict[str, list[Field]]:
    """Return the C records by name."""
    ground, legs = bool(has.contacts), has.legs
    touched = [*BRISTLES[1:], *EVENT_FIELDS] * ground
    found = {
        "piecewise": PIECEWISE,
        "controller": [*CONTROLLER[:2], *TENSIONS[: has.tendons], *PFL * has.pfl, *CONTROLLER[2:]],
        "drive": DRIVE + LEGS * legs + GIVEN * bool(has.given) + LOADS * bool(has.loads),
        "run": [*START, *BRISTLES[:1] * ground, *SETTINGS, *touched, *KEPT]
        + CONTACT_KEPT * ground
        + LANDED * legs,
    }
    return found | ({"tape": TAPE + TIES * ground + LANDINGS * legs} if has.gradients else {})


DESCRIPTIONS = {
    "piecewise": (
        "Functions of time as piecewise polynomials: torques, reference motions, leg angles."
    ),
    "controller": "Torques of the tail: the sum of the parts that are set.",
    "drive": "Controllers of a run, one after another, and times at which they are not smooth.",
    "run": (
        "A run.  The caller sets all members up to `work`, with contacts up to `event_kinds`, and "
        "the others to zero."
    ),
    "tape": (
        "The states of a run at the ends of all steps, and derivatives along it.  The caller sets "
        "sizes and arrays, and sums to zero."
    ),
}


def layouts(has: SimulationFeatures) -> dict[str, list[list[str]]]:
    """Return the members of every record, name and kind, for a caller in another language."""
    return {record: layout(members) for record, members in records(has).items()}


def layout(members: Sequence[Field]) -> list[list[str]]:
    """Return the members of one record, name and kind."""
    return [[f.name, f.kind] for f in members]


PIECEWISE = fields("""
    int pieces: number of polynomials
    int channels: number of functions of time in the table
    int degree: degree of the polynomials
    const real *times: [pieces + 1] limits of the pieces, increasing (s)
    const real *coefficients: [pieces][channels][degree + 1], for powers of t - times[piece],
        constants first
""")
CONTROLLER = fields("""
    const real *damping: [NT] damping (N m s): tau = -damping q_t_dot (Eq. 47); NULL: none
    const piecewise *torques: NT channels of torques (N m), added; NULL: none
    torque function: your torques (N m), added; NULL: none
    void *context: first argument of `function`
    real clock: time of the run at which the clock of `function` is 0 (s)
""")
TENSIONS = fields("""
    const piecewise *tensions: a channel (N) for each tendon, whose torques are added; NULL: none
""")
PFL = fields("""
    const piecewise *reference: NT channels (rad) that Eq. 46 tracks; its torques are added; NULL:
        none
    real kp: gain K_p of tracking (1/s^2)
    real kd: gain K_d of tracking (1/s)
    int feedforward: 1: add the acceleration of the reference; 0: feedback only
    const real *limit: [NT] largest torque of tracking (N m); NULL: no limit
""")
DRIVE = fields("""
    int phases: number of controllers
    const real *begins: [phases] start of each controller, increasing (s); the first also acts
        before
    const controller *controllers: [phases] one controller after another
    int stops: number of times at which a torque or leg motion is not smooth
    const real *stop_times: [stops] these times, increasing (s); steps end there
""")
LEGS = fields("""
    const piecewise *legs: 4 channels: gamma_1, delta_1, gamma_2, delta_2 (rad)
    const piecewise *landing: the same from a touch-down of the feet on, in one piece over the time
        since then; NULL: `legs` go on
    real landing_from: the first touch-down from this time (s) on counts
""")
GIVEN = fields("""
    const piecewise *given: a channel for each prescribed coordinate (rad)
""")
LOADS = fields("""
    const piecewise *loads: forces from outside, a channel for each number of `push`; NULL: none
""")
START = fields("""
    const parameters *parameters: parameters of the model
    const drive *drive: controllers and leg motion
    real t: time (s): the start, then the current time
    real *q: [NQ] configuration: the start, then the current one
    real *v: [NV] velocity: the start, then the current one
    real *ledger: work so far (J) of torques, damping, ground, legs; impulses (N s) on groups; or
        NULL
""")
BRISTLES = fields("""
    real *bristles: [2 CONTACTS] bristle deflections (m): the start, then the current ones
    real *bristles_out: [samples][2 CONTACTS] bristle deflections (m)
""")
SETTINGS = fields("""
    int method: one of the methods above
    real rtol: relative tolerance of one step
    real atol: absolute tolerance, added (m, rad, m/s, rad/s; mm for bristles)
    real step: fixed step, or first step of an adaptive method (s); 0: it is chosen
    real least_step: smallest step (s)
    real most_step: largest step (s)
    long most_steps: largest number of steps, accepted and rejected
    long pause: largest number of steps in one call
    long samples: number of samples
    const real *times: [samples] times, increasing from t (s); the run ends at the last
    real *q_out: [samples][NQ] configurations
    real *v_out: [samples][NV] velocities
    real *tau_out: [samples][NT] torques (N m)
    real *work: [WORK_ROLLOUT] workspace; it contains the run between calls
""")
EVENT_FIELDS = fields("""
    real *peaks: [parts][2] largest force (N) so far on all points, each group, each foot, and its
        time (s); or NULL
    int stop_at: sum of 1 << event for events that end the run; event = 2 group + (0: it begins to
        press, 1: it ceases to)
    long most_events: length of the next two arrays
    real *event_times: [most_events] times of events (s)
    int *event_kinds: [most_events] events; 2 GROUPS + group: all points of the group are above
        ground again
    long events: number of events so far
    long unfelt: contacts shorter than a step, which its stages may have missed
""")
KEPT = fields("""
    int begun: whether the run has started
    long done: number of samples written
    long steps: number of accepted steps
    long rejected: number of rejected steps
    long evaluations: number of evaluations of the forward dynamics
    long factorisations: number of factorisations of 1 - w J
    int stop: index of the next stop of the drive
    real until: end of the current smooth part (s)
    real next_step: length of the next step (s)
    real error_before: error of the last step relative to the tolerance
    int known: whether the workspace contains the rate at t
""")
CONTACT_KEPT = fields("""
    int touching: whether a point touches the ground at t
    int near_point: point that passed above the ground, the closest for its error
    real near_time: time of this pass (s)
    real near_height: height of the point (m)
    real near_error: estimated error of the height (m), larger than it; 0: no such pass
""")
LANDED = fields("""
    real landed_at: time (s) at which `landing` began; far off: not yet
""")

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
    real *state: [STATE] gradient by the end, then by the start; or change of the start, then of
        the end
    real *by_parameters: [PARAMETERS] gradient by the parameters, or their change
    real *by_times: [room] gradients by the times of nodes, or their changes
    long row: rows so far
    real *rows: [7 room][ROW] t, until, tail rates; gradients by torques and legs there, or
        their changes
    long step: number of the step that is computed again
    real largest: largest gradient by q and v at a node
""")
TIES = fields("""
    real *ties: [room][CONTACTS][3] weights of the margins whose zero moves a node
    real *sides: [room][CONTACTS][2] of each step: positive where a point presses, and where it
      slides
    int *sunk: [room] whether a point is in the ground at an end of each step
    real touched: last time (s) at which a point touched the ground
""")
LANDINGS = fields("""
    real landed_at: time at which the legs' landing begins (s)
    real by_landing: gradient by this time, or its change
""")


def record_views(prefix: str, has: SimulationFeatures) -> dict[str, list[dict]]:
    """Return the records with the C types that this model's header gives them."""
    return {record: member_views(of, prefix) for record, of in records(has).items()}


def member_views(members: Sequence[Field], prefix: str) -> list[dict]:
    """Return the members of one record with their C types."""
    return [{"type": _typed(f.type, prefix), "name": f.name, "meaning": f.meaning} for f in members]


def _typed(text: str, prefix: str) -> str:
    """Return a C type with the model's prefix, ready for a name to follow."""
    full = re.sub(TYPES, lambda name: f"{prefix}_{name.group()}", text)
    return full if full.endswith("*") else full + " "


STEPS = fields("""
    const real *parameters: [count][PARAMETERS]
    real *q: [count][NQ] configurations, advanced in place
    real *v: [count][NV] velocities, advanced in place
    const real *torques: [NT] constant torques (N m) of the first state
    size_t torques_apart: reals from one state's torques to the next; 0: the same for all
    size_t count: number of states; STATES are computed at a time
    real h: length of a step (s)
    long steps: number of steps
    real *work: workspace
    size_t first: first of the states that are computed now; those before it are done
""")
GROUND_STEPS = fields("""
    real *bristles: [count][NU] bristle deflections (m), advanced in place
    const real *legs: [4][2] angle (rad) and rate (rad/s) of each hinge, first state
    size_t legs_apart: reals from one state's legs to the next; 0: the same for all
""")


def steps_record(bristles: int) -> list[Field]:
    """Return the record of steps of many states under constant torques."""
    return (GROUND_STEPS if bristles else []) + STEPS


ROLLOUTS = fields("""
    void *runs: [count] run records of the simulation header, all by rk4 or all by tsit5
    long count: number of runs
    int *statuses: [count] of ended runs: OK; anything else: compute the run by itself
    long *lanes: [STATES] index of the run in each lane; -1: none
    long next: index of the next run to start
    long pause: largest number of steps in one call
    real *work: workspace; it contains the flights between calls
    int lane: the lane whose run all others are in step with; -1: they are not
""")

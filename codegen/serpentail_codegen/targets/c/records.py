"""The records of a simulation: C structs that the caller fills in, and that hold its state between
calls.

One table lists the members of each record, with their C types and meanings. The header's structs
and the manifest's list of members follow from it; the runtime builds the same structs from the
manifest.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from .simulation_features import SimulationFeatures

TYPES = r"\b(real|piecewise|controller|drive|parameters|torque)\b"  # that get the model's prefix


@dataclass(frozen=True)
class Field:
    """One member of a C record: its name, type and meaning."""

    name: str
    type: str
    meaning: str

    @property
    def kind(self) -> str:
        """Return what a caller in another language stores in it."""
        return "pointer" if "*" in self.type or self.type == "torque" else self.type


def fields(*rows: tuple[str, str, str]) -> list[Field]:
    """Return the members of a record."""
    return [Field(*row) for row in rows]


def records(has: SimulationFeatures) -> dict[str, list[Field]]:
    """Return the C records by name."""
    return {
        "piecewise": PIECEWISE,
        "controller": CONTROLLER[:2] + (PFL if has.pfl else []) + CONTROLLER[2:],
        "drive": DRIVE + (LEGS if has.legs else []),
        "run": START
        + LEDGER
        + (BRISTLES[:1] if has.contacts else [])
        + SETTINGS
        + SAMPLES
        + (contact_samples(has))
        + KEPT
        + (CONTACT_KEPT if has.contacts else [])
        + (LANDED if has.legs else []),
    }


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
}


def layouts(has: SimulationFeatures) -> dict[str, list[list[str]]]:
    """Return the members of every record, name and kind, for a caller in another language."""
    return {record: layout(members) for record, members in records(has).items()}


def layout(members: Sequence[Field]) -> list[list[str]]:
    """Return the members of one record, name and kind."""
    return [[f.name, f.kind] for f in members]


PIECEWISE = fields(
    ("pieces", "int", "number of polynomials"),
    ("channels", "int", "number of functions of time in the table"),
    ("degree", "int", "degree of the polynomials"),
    ("times", "const real *", "[pieces + 1] limits of the pieces, increasing (s)"),
    (
        "coefficients",
        "const real *",
        "[pieces][channels][degree + 1], for powers of t - times[piece], constants first",
    ),
)
CONTROLLER = fields(
    (
        "damping",
        "const real *",
        "[NT] damping (N m s): tau = -damping q_t_dot (Eq. 47); NULL: none",
    ),
    ("torques", "const piecewise *", "NT channels of torques (N m), added; NULL: none"),
    ("function", "torque", "your torques (N m), added; NULL: none"),
    ("context", "void *", "first argument of `function`"),
    ("clock", "real", "time of the run at which the clock of `function` is 0 (s)"),
)
PFL = fields(
    (
        "reference",
        "const piecewise *",
        "NT channels (rad) that Eq. 46 tracks; its torques are added; NULL: none",
    ),
    ("kp", "real", "gain K_p of tracking (1/s^2)"),
    ("kd", "real", "gain K_d of tracking (1/s)"),
    ("feedforward", "int", "1: add the acceleration of the reference; 0: feedback only"),
    ("limit", "const real *", "[NT] largest torque of tracking (N m); NULL: no limit"),
)
DRIVE = fields(
    ("phases", "int", "number of controllers"),
    (
        "begins",
        "const real *",
        "[phases] start of each controller, increasing (s); the first also acts before",
    ),
    ("controllers", "const controller *", "[phases] one controller after another"),
    ("stops", "int", "number of times at which a torque or leg motion is not smooth"),
    ("stop_times", "const real *", "[stops] these times, increasing (s); steps end there"),
)
LEGS = fields(
    ("legs", "const piecewise *", "4 channels: gamma_1, delta_1, gamma_2, delta_2 (rad)"),
    (
        "landing",
        "const piecewise *",
        "the same from a touch-down of the feet on, in one piece over the time since then; NULL: "
        "`legs` go on",
    ),
    ("landing_from", "real", "the first touch-down from this time (s) on counts"),
)
START = fields(
    ("parameters", "const parameters *", "parameters of the model"),
    ("drive", "const drive *", "controllers and leg motion"),
    ("t", "real", "time (s): the start, then the current time"),
    ("q", "real *", "[NQ] configuration: the start, then the current one"),
    ("v", "real *", "[NV] velocity: the start, then the current one"),
)
LEDGER = fields(
    (
        "ledger",
        "real *",
        "work so far (J) of torques, damping, ground, legs; impulses (N s) on groups; or NULL",
    )
)
BRISTLES = fields(
    (
        "bristles",
        "real *",
        "[2 CONTACTS] bristle deflections (m): the start, then the current ones",
    ),
    ("bristles_out", "real *", "[samples][2 CONTACTS] bristle deflections (m)"),
)
SETTINGS = fields(
    ("method", "int", "one of the methods above"),
    ("rtol", "real", "relative tolerance of one step"),
    ("atol", "real", "absolute tolerance, added (m, rad, m/s, rad/s; mm for bristles)"),
    ("step", "real", "fixed step, or first step of an adaptive method (s); 0: it is chosen"),
    ("least_step", "real", "smallest step (s)"),
    ("most_step", "real", "largest step (s)"),
    ("most_steps", "long", "largest number of steps, accepted and rejected"),
    ("pause", "long", "largest number of steps in one call"),
)
SAMPLES = fields(
    ("samples", "long", "number of samples"),
    ("times", "const real *", "[samples] times, increasing from t (s); the run ends at the last"),
    ("q_out", "real *", "[samples][NQ] configurations"),
    ("v_out", "real *", "[samples][NV] velocities"),
    ("tau_out", "real *", "[samples][NT] torques (N m)"),
    ("work", "real *", "[WORK_ROLLOUT] workspace; it contains the run between calls"),
)
EVENT_FIELDS = fields(
    (
        "peaks",
        "real *",
        "[parts][2] largest force (N) so far on all points, each group, each foot, and its time "
        "(s); or NULL",
    ),
    (
        "stop_at",
        "int",
        "sum of 1 << event for events that end the run; event = 2 group + (0: it begins to press, "
        "1: it ceases to)",
    ),
    ("most_events", "long", "length of the next two arrays"),
    ("event_times", "real *", "[most_events] times of events (s)"),
    (
        "event_kinds",
        "int *",
        "[most_events] events; 2 GROUPS + group: all points of the group are above ground again",
    ),
    ("events", "long", "number of events so far"),
    ("unfelt", "long", "contacts shorter than a step, which its stages may have missed"),
)
KEPT = fields(
    ("begun", "int", "whether the run has started"),
    ("done", "long", "number of samples written"),
    ("steps", "long", "number of accepted steps"),
    ("rejected", "long", "number of rejected steps"),
    ("evaluations", "long", "number of evaluations of the forward dynamics"),
    ("factorisations", "long", "number of factorisations of 1 - w J"),
    ("stop", "int", "index of the next stop of the drive"),
    ("until", "real", "end of the current smooth part (s)"),
    ("next_step", "real", "length of the next step (s)"),
    ("error_before", "real", "error of the last step relative to the tolerance"),
    ("known", "int", "whether the workspace contains the rate at t"),
)


CONTACT_KEPT = fields(
    ("touching", "int", "whether a point touches the ground at t"),
    ("near_point", "int", "point that passed above the ground, the closest for its error"),
    ("near_time", "real", "time of this pass (s)"),
    ("near_height", "real", "height of the point (m)"),
    ("near_error", "real", "estimated error of the height (m), larger than it; 0: no such pass"),
)
LANDED = fields(("landed_at", "real", "time (s) at which `landing` began; far off: not yet"))


def contact_samples(has: SimulationFeatures) -> list[Field]:
    """Return the members that a run with contacts has."""
    return BRISTLES[1:] + EVENT_FIELDS if has.contacts else []


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


STEPS = fields(
    ("parameters", "const real *", "[count][PARAMETERS]"),
    ("q", "real *", "[count][NQ] configurations, advanced in place"),
    ("v", "real *", "[count][NV] velocities, advanced in place"),
    ("torques", "const real *", "[NT] constant torques (N m) of the first state"),
    ("torques_apart", "size_t", "reals from one state's torques to the next; 0: the same for all"),
    ("count", "size_t", "number of states; STATES are computed at a time"),
    ("h", "real", "length of a step (s)"),
    ("steps", "long", "number of steps"),
    ("work", "real *", "workspace"),
    ("first", "size_t", "first of the states that are computed now; those before it are done"),
)
GROUND_STEPS = fields(
    ("bristles", "real *", "[count][NU] bristle deflections (m), advanced in place"),
    ("legs", "const real *", "[4][2] angle (rad) and rate (rad/s) of each hinge, first state"),
    ("legs_apart", "size_t", "reals from one state's legs to the next; 0: the same for all"),
)


def steps_record(bristles: int) -> list[Field]:
    """Return the record of steps of many states under constant torques."""
    return (GROUND_STEPS if bristles else []) + STEPS


ROLLOUTS = fields(
    ("runs", "void *", "[count] run records of the simulation header, all by rk4 or all by tsit5"),
    ("count", "long", "number of runs"),
    ("statuses", "int *", "[count] of ended runs: OK; anything else: compute the run by itself"),
    ("lanes", "long *", "[STATES] index of the run in each lane; -1: none"),
    ("next", "long", "index of the next run to start"),
    ("pause", "long", "largest number of steps in one call"),
    ("work", "real *", "workspace; it contains the flights between calls"),
    ("lane", "int", "the lane whose run all others are in step with; -1: they are not"),
)

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
        + KEPT,
    }


DESCRIPTIONS = {
    "piecewise": (
        "Functions of time, polynomials piece by piece: torques, reference motions, leg angles."
    ),
    "controller": "Torques of the tail: the sum of the parts that are there.",
    "drive": "What acts in a run: controllers, one after another, and where they are not smooth.",
    "run": "A run, zero but for what its caller sets: all up to `work`.",
}


def layouts(has: SimulationFeatures) -> dict[str, list[list[str]]]:
    """Return the members of every record, name and kind, for a caller in another language."""
    return {record: [[f.name, f.kind] for f in members] for record, members in records(has).items()}


PIECEWISE = fields(
    ("pieces", "int", "number of polynomials"),
    ("channels", "int", "functions of time in the table"),
    ("degree", "int", "of the polynomials"),
    ("times", "const real *", "[pieces + 1] increasing (s)"),
    (
        "coefficients",
        "const real *",
        "[pieces][channels][degree + 1] of powers of t - times[piece], constants first",
    ),
)
CONTROLLER = fields(
    ("damping", "const real *", "[NT] N m s: tau = -damping q_t_dot (Eq. 47); NULL: none"),
    ("torques", "const piecewise *", "of NT channels (N m), added; NULL: none"),
    ("function", "torque", "added; NULL: none"),
    ("context", "void *", "its first argument"),
    ("clock", "real", "s, the run's time at which the clock of `function` is at 0"),
)
PFL = fields(
    (
        "reference",
        "const piecewise *",
        "of NT channels (rad) that Eq. 46 tracks, added; NULL: none",
    ),
    ("kp", "real", "1/s^2"),
    ("kd", "real", "1/s"),
    ("feedforward", "int", "whether the reference's acceleration is asked for"),
    ("limit", "const real *", "[NT] N m, the most that tracking gives; NULL: no limit"),
)
DRIVE = fields(
    ("phases", "int", "number of controllers"),
    ("begins", "const real *", "[phases] increasing (s); the first acts before its time, too"),
    ("controllers", "const controller *", "[phases]"),
    ("stops", "int", "number of times where what acts jumps or has a kink"),
    ("stop_times", "const real *", "[stops] increasing (s): steps end there"),
)
LEGS = fields(
    ("legs", "const piecewise *", "of 4 channels: gamma_1, delta_1, gamma_2, delta_2 (rad)")
)
START = fields(
    ("parameters", "const parameters *", "of the model"),
    ("drive", "const drive *", "what acts"),
    ("t", "real", "start, then where it is (s)"),
    ("q", "real *", "[NQ] likewise"),
    ("v", "real *", "[NV] likewise"),
)
LEDGER = fields(
    (
        "ledger",
        "real *",
        "work (J) of torques, damping, ground, legs, and impulses (N s) of groups: so far; or NULL",
    )
)
BRISTLES = fields(
    ("bristles", "real *", "[2 CONTACTS] likewise (m)"),
    ("bristles_out", "real *", "[samples][2 CONTACTS]"),
)
SETTINGS = fields(
    ("method", "int", "one of the methods"),
    ("rtol", "real", "error of a step over a state's size"),
    ("atol", "real", "added to it (m, rad, m/s, rad/s; mm of bristles)"),
    ("step", "real", "fixed step; else the first, 0: chosen (s)"),
    ("least_step", "real", "(s)"),
    ("most_step", "real", "(s)"),
    ("most_steps", "long", "accepted and rejected"),
    ("pause", "long", "steps of one call"),
)
SAMPLES = fields(
    ("samples", "long", "wanted"),
    ("times", "const real *", "[samples] increasing (s), from t on; the run ends at the last"),
    ("q_out", "real *", "[samples][NQ]"),
    ("v_out", "real *", "[samples][NV]"),
    ("tau_out", "real *", "[samples][NT]"),
    ("work", "real *", "[WORK_ROLLOUT]; holds the run between calls"),
)
EVENT_FIELDS = fields(
    (
        "stop_at",
        "int",
        "sum of 1 << event: the run ends at the first of these; event = 2 group + (0: it begins to "
        "press, 1: it ceases to)",
    ),
    ("most_events", "long", "that fit"),
    ("event_times", "real *", "[most_events] (s)"),
    (
        "event_kinds",
        "int *",
        "[most_events] of events; 2 GROUPS + group: all its points are out of the ground again",
    ),
    ("events", "long", "that happened"),
    ("unfelt", "long", "touches shorter than a step, which no stage may have felt"),
)
KEPT = fields(
    ("begun", "int", "0 at first"),
    ("done", "long", "samples written"),
    ("steps", "long", "accepted"),
    ("rejected", "long", ""),
    ("evaluations", "long", "of forward dynamics"),
    ("factorisations", "long", ""),
    ("stop", "int", "next of the drive's stops"),
    ("until", "real", "where the steps' smooth part ends (s)"),
    ("next_step", "real", "(s)"),
    ("error_before", "real", "of the last step over what is allowed"),
    ("known", "int", "whether the rate at t is in the workspace"),
)


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

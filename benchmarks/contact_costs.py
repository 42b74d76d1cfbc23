"""Cost of a flight, a stance (feet) and a tail contact (feet, tail) of one model.

Size of its C file, operations and nanoseconds of one v_dot and of the matrix of an implicit step,
factored; single calls from C, with half of the foot points in the ground.
"""

from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.models import built, label, timed_function
from benchmarks.timing import States, time_rounds

SCENES: dict[str, tuple[str, ...]] = {"flight": (), "stance": ("feet",), "tail": ("feet", "tail")}
SIZES = ((1, 3), (3, 4), (3, None))
STATES, ROUNDS, CALLS = 64, 300, 512
STANDING = [0, 0, 0.0225, 1, 0.1, 0, 0]  # as a rat stands: half of its foot points in the ground
LEGS = [3.665, -0.2618, 3.665, -0.2618, 0, 0, 0, 0]


def measured(folder: Path) -> list[dict]:
    """Return a row for each tail and scene."""
    return [row(folder, size, scene) for size in SIZES for scene in SCENES]


def row(folder: Path, size: tuple, scene: str) -> dict:
    """Return the costs of one tail in one scene."""
    contacts = SCENES[scene]
    dynamics = "contact_dynamics" if contacts else "forward_dynamics"
    touching = {"contacts": list(contacts)} if contacts else {}
    needed = ("contact_points",) if contacts else ()
    model = built(*size, functions=[dynamics, "implicit", *needed], **touching)
    source = model.folder / "src" / f"{model.name}.c"
    found = {"model": label(*size), "contacts": ", ".join(contacts) or "none"}
    found |= {"points": sum(model.contacts.values()), "C, bytes": source.stat().st_size}
    for name, words in ((dynamics, "v_dot"), ("implicit_factor", "implicit")):
        ours = timed_function(model, folder, name)
        (least,) = time_rounds([ours.closure], states(model, name), ROUNDS, CALLS)
        operations = model.manifest["functions"][name]["operations"]
        found |= {f"operations of {words}": operations, f"{words}, ns": least}
    return found


def states(model: st.Model, function: str) -> States:
    """Return states near standing with small rates, and all other inputs of a function."""
    rng, kernel = np.random.default_rng(1), model.kernel(function)
    given = {"legs": LEGS, "damping": 1e-3, "gains": 0.0, "weight": [1e-4, 1.0]}
    given["weight"] = given["weight"] if model.contacts else 1e-4
    columns = []
    for name, shape in zip(kernel.names, kernel.shapes, strict=True):
        size = (STATES, int(np.prod(shape)))
        if name == "q":
            tail = rng.normal(0, 0.2, (STATES, model.nv - 6))
            columns.append(np.hstack([np.tile(STANDING, (STATES, 1)), tail]))
        elif name in given:
            columns.append(np.broadcast_to(given[name], size))
        else:
            columns.append(rng.normal(0, 1e-3, size))
    q, v, *rest = columns
    return States(q, v, np.hstack(rest))

"""Each status of the C has a number of its own, and the runtime knows the same numbers."""

import re

from serpentail.model import library
from tests.support.models import model_folder

KNOWN = (
    "PAUSED",
    "STEP_TOO_SMALL",
    "TOO_MANY_STEPS",
    "STOPPED_AT_EVENT",
    "TORQUE_FAILED",
    "STEP_TOO_LONG",
    "BAD_TIMES",
)


def statuses(header, prefix):
    """Names and numbers of the enumerations that tell how a call or a run stands."""
    found = {}
    for body in re.findall(r"enum \{(.*?)\}", header, re.DOTALL):
        if "_OK =" in body or "_PAUSED =" in body:
            found |= dict(re.findall(rf"{prefix}_(\w+) = (\d+)", body))
    return found


def test_statuses_differ_and_the_runtime_knows_them():
    folder = model_folder(1, 1, functions=["energy", "momentum", "rollout"])
    (header,) = (folder / "include").glob("*_simulation.h")
    model = (folder / "include" / header.name.replace("_simulation", "")).read_text()
    prefix = header.name.removesuffix("_simulation.h").upper()
    found = statuses(model, prefix) | (runs := statuses(header.read_text(), prefix))
    assert len(runs) == 8 and len(set(found.values())) == len(found) > 9
    assert {name: int(runs[name]) for name in KNOWN} == {
        name: getattr(library, name) for name in KNOWN
    }
    assert int(found["NOT_FINITE"]) == library.NOT_FINITE

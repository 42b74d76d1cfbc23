"""What a page needs to compute a run again, as data; or the reason why it only replays."""

import base64
import gzip
from typing import Any

import numpy as np

from ...basics.plausible_values import LARGEST
from ...model.library import WHY
from ...model.model import Model
from ...model.passive import BEHIND
from ...motion import landing, plausibility
from ...motion.derived import AGAIN
from ...motion.trajectory import Trajectory
from ...simulation import audit, ground
from ...simulation.energies import EASE_STOPS
from ...simulation.methods import SCIPY
from ...simulation.runs.outcomes import FAILED, SHORT_STEPS, TOO_STRONG
from ...simulation.runs.single import CompiledRun
from ...simulation.simulate import RunAgain
from .image import BASE, Image
from .knobs import knobs, parameter_places
from .webassembly import webassembly

# functions that a page calls on all samples, if the model has them
CALLED = ("energy", "momentum", "tail_points", "leg_points", "center_of_mass")
CALLED += ("contact_points", "contact_rates")
ARRAYS = 10  # of the argument record of a function
ENDLESS = 2**31 - 1  # steps of one call
WORDS = audit.WORDS | plausibility.WORDS
WORDS |= {"deep": ground.DEEP, "failed": FAILED, "too_strong": TOO_STRONG, "behind": BEHIND}
WORDS |= {"ease_stops": EASE_STOPS}
LIMITS = {  # of warnings and numbers
    "deep": plausibility.DEEP,
    "sunk": plausibility.SUNK,
    "borne": plausibility.BORNE,
    "bearer": plausibility.BEARER,
    "bend": plausibility.MOST_BEND,
    "degrees": plausibility.DEGREES,
    "static": ground.MAX_STATIC_LOAD,
    "upright": landing.MIN_UPRIGHT,
    "speed": landing.MAX_SPEED,
    "share": landing.MIN_SHARE,
    "difference": audit.DIFFERENCE,
    "fastest": LARGEST["rad/s"][0],  # rad/s
}


def computed_again(model: Model, motion: Trajectory, most: int) -> dict[str, Any] | str:
    """Return the data for a page that computes a motion of at most so many samples, for JSON.

    Where that cannot be, return the reason. ExtraMissing, CompileFailed and SerpentailError as of
    ``webassembly``.
    """
    again = vars(motion).get(AGAIN)
    reason = _why_not(model, motion, again, most)
    return reason if reason or again is None else _data(model, again)


def _why_not(model: Model, motion: Trajectory, again: RunAgain | None, most: int) -> str:
    """Return why a page cannot compute a motion; "" if it can."""
    if again is None:
        return "only what simulate has just made can be computed again, not a file, a plan, a part"
    if model.manifest["real"] != "double" or model.manifest["scene"]["baked"]:
        return 'the model needs real = "double" and baked = false'
    if again.method.name in SCIPY:
        return f"{again.method.name} is a method of Python: take one in C, such as tsit5"
    if again.ground.stop_at:
        return "it ends at an event: leave out stop_at"
    if len(motion.t) > most:
        return f"it has {len(motion.t)} samples: a longer output_step gives {most} or fewer"
    return ""


def _data(model: Model, again: RunAgain) -> dict[str, Any] | str:
    """Return the data of a run that is made of C, else the reason."""
    run = CompiledRun(again.runs(again.start, again.ground, again.method))
    parts = run.actuation.parts
    if any(each.user or each.native or each.state for each in parts):
        return "its controller is a function: only Damping, torques over time and Pfl are C"
    arrays = [run.runs.parameters.vectors, run.runs.peaks]
    image = Image(run.runs.records, [*arrays, *run.runs.state.values(), *run.runs.out.values()])
    run.record.pause = ENDLESS
    record = image.record(run.record)
    manifest, info = run.runs.records.code.manifest, again.method.info
    outputs, calls = _calls(run, image)
    prefix = manifest["prefix"]
    exports = [f"{prefix}_rollout", *(f"{prefix}_batch_{name}" for name in calls)]
    eps = float(np.finfo(float).eps)
    return {
        "module": _text(webassembly(run.runs.records.code.checked, exports)),
        "image": _text(bytes(image.bytes)),
        "base": BASE,
        "prefix": prefix,
        "run": record,
        "members": image.offsets("run"),
        "calls": calls,
        "arrays": outputs,
        "parameters": parameter_places(run, image),
        "values": {name: np.atleast_1d(x).tolist() for name, x in model.parameters.items()},
        "knobs": knobs(run, image),
        "times": again.start.times.tolist(),
        "nt": model.layout.nt,
        "fixed": model.fixed,
        "groups": model.contacts,
        "ledger": manifest["simulation"]["ledger"],
        "parts": manifest["simulation"].get("parts", []),
        "joints": model.joints_each.tolist(),
        "kinds": list(model.kinds),
        "pieces": manifest["dimensions"]["total"],
        "polar": manifest["scene"]["coordinates"] == "polar",
        "names": list(model.names.tail),
        "eps": eps,
        "allowed": audit.allowance(info, eps),
        "remedy": audit.remedy(info),
        "why": WHY,
        "short": SHORT_STEPS,
        "words": WORDS,
        "limits": LIMITS,
    }


def _calls(run: CompiledRun, image: Image) -> tuple[dict[str, Any], dict[str, int]]:
    """Put arrays of all samples and records of calls into an image.

    Return addresses and widths of the arrays by name, and the addresses of the records.
    """
    model, rows = run.model, len(run.runs.start.times)
    known = {name: (image.array(array), array.shape[2]) for name, array in run.runs.out.items()}
    legs = run.runs.ground.legs_at(run.runs.start.times)
    if legs:
        angles = np.ascontiguousarray(legs[0][:, : ground.LEG_ANGLES])
        known["legs"] = image.put(legs[0].tobytes()), legs[0].shape[1]
        known["angles"] = image.put(angles.tobytes()), angles.shape[1]
    manifest, calls = run.runs.records.code.manifest, {}
    for name in CALLED:
        entry = manifest["functions"].get(name)
        if entry is None or (name == "leg_points" and not legs):
            continue
        work = image.put(bytes(8 * manifest["work"][name]))
        addresses = [known[each["name"]][0] for each in entry["inputs"]]
        for each in entry["outputs"]:
            width = int(np.prod(each["shape"]))
            known[f"{name}.{each['name']}"] = image.put(bytes(8 * width * rows)), width
            addresses.append(known[f"{name}.{each['name']}"][0])
        vector = image.array(run.runs.parameters.vectors)
        addresses += [0] * (ARRAYS - len(addresses))
        call = np.array([vector, rows, 0, work, *addresses], "<u4")
        calls[name] = image.put(call.tobytes())
    return known, calls


def _text(content: bytes) -> str:
    """Return bytes as text: gzip, base64."""
    return base64.b64encode(gzip.compress(content, mtime=0)).decode("ascii")

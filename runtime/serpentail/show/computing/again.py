"""What a page needs to compute a run again, as data; or the reason why it only replays."""

from typing import Any

import numpy as np

from ...basics.checks import refuse_not_finite
from ...basics.errors import StateError
from ...model.chains import limbs_of
from ...model.library import WHY
from ...model.model import Model
from ...model.passive import BEHIND
from ...motion import landing, plausibility
from ...motion.derived import AGAIN
from ...motion.trajectory import Trajectory
from ...simulation import audit, ground
from ...simulation.energies import EASE_STOPS
from ...simulation.methods import SCIPY
from ...simulation.runs.outcomes import FAILED
from ...simulation.runs.single import CompiledRun
from ...simulation.simulate import RunAgain
from ..page.samples import as_text
from .image import BASE, Image
from .knobs import REAL, knobs, refusal_of
from .webassembly import webassembly

# functions that a page calls on all samples, if the model has them
CALLED = (
    *("energy", "momentum", "tail_points", "leg_points", "center_of_mass"),
    *("contact_points", "contact_rates"),
)
ARRAYS = 10  # of the argument record of a function
ENDLESS = 2**31 - 1  # steps of one call
WORDS = audit.WORDS | plausibility.WORDS | {"deep": ground.DEEP, "failed": FAILED}
WORDS |= {"behind": BEHIND, "ease_stops": EASE_STOPS}
_RATE = {"field": "v0", "array": np.array([np.nan]), "error": StateError}
WORDS["rate"] = refusal_of(refuse_not_finite, _RATE).replace("[0]", "[{at}]")
LIMITS = {  # of warnings and numbers
    name: getattr(module, name)
    for module, names in (
        (plausibility, ("DEEP", "SUNK", "BORNE", "BEARER", "MOST_BEND", "DEGREES")),
        (landing, ("MIN_UPRIGHT", "MAX_SPEED", "MIN_SHARE")),
        (audit, ("DIFFERENCE",)),
        (ground, ("MAX_STATIC_LOAD",)),
    )
    for name in names
}


def computed_again(model: Model, motion: Trajectory, most: int) -> dict[str, Any] | str:
    """Return the data for a page that computes a motion of at most so many samples, for JSON.

    Where that cannot be, return the reason. Errors as of ``webassembly``.
    """
    again = vars(motion).get(AGAIN)
    if not isinstance(again, RunAgain):
        return "only one run that simulate has just made can be computed again, no file and no plan"
    run = CompiledRun(again.runs(again.start, again.ground, again.method))
    parts, method, rows = run.actuation.parts, again.method.name, len(motion.t)
    unfit = model.manifest["real"] != "double" or model.manifest["scene"]["baked"]
    reasons = {
        'the model needs real = "double" and baked = false': unfit,
        f"{method} is a method of Python: take one in C, such as tsit5": method in SCIPY,
        "gravity_vector: pages know gravity along -z alone": "gravity_vector" in model.parameters,
        "it has prescribed joints, whose table pages do not know": model.layout.given > 0,
        "it ends at an event: leave out stop_at": again.ground.stop_at,
        f"it has {rows} samples: a longer output_step gives {most} or fewer": rows > most,
        "forces from outside act: leave out load": again.ground.loads is not None,
        "its controller is a function: only Damping, torques over time and Pfl are C": any(
            each.user or each.native for each in parts
        ),
    }
    return next((each for each, true in reasons.items() if true), None) or _data(model, again, run)


def _data(model: Model, again: RunAgain, run: CompiledRun) -> dict[str, Any]:
    """Return the data of a run."""
    runs, code = run.runs, run.runs.records.code
    arrays = [runs.parameters.vectors, runs.peaks, *runs.state.values(), *runs.out.values()]
    image = Image(runs.records, arrays)
    run.record.pause = ENDLESS
    record = image.put(image.translated(run.record))
    parameters, place = {}, image.at(run.record.parameters)
    for p in (p for p in model.manifest["parameters"] if p["in_struct"]):
        parameters[p["name"]] = place, p["size"]
        place += REAL * p["size"]
    outputs, calls = _calls(run, image)
    prefix, info = code.manifest["prefix"], again.method.info
    exports = [f"{prefix}_rollout", *(f"{prefix}_batch_{name}" for name in calls)]
    eps, kind = float(np.finfo(float).eps), image.types["run"]
    offsets = {name: (getattr(kind, name).offset, of) for name, of in image.members["run"]}
    simulation = {name: code.manifest["simulation"].get(name, []) for name in ("ledger", "parts")}
    return simulation | {
        "module": as_text(webassembly(code.checked, exports)),
        "image": as_text(bytes(image.bytes)),
        "base": BASE,
        "prefix": prefix,
        "run": record,
        "members": offsets,
        "calls": calls,
        "arrays": outputs,
        "parameters": parameters,
        "values": {name: np.atleast_1d(x).tolist() for name, x in model.parameters.items()},
        "knobs": knobs(run, image, parameters),
        "times": runs.start.times.tolist(),
        "nt": model.nu,
        "fixed": model.fixed,
        "groups": model.contacts,
        "joints": np.repeat(model.turns_each, model.layout.widths).tolist(),
        "kinds": model.kinds,
        "firsts": model.layout.firsts,
        "chains": [
            {
                "name": c.name,
                "owner": c.owner,
                "limb": c.name in limbs_of(model),
                "first": c.tau.start,
                "stop": c.tau.stop,
                "points": [c.points.start, c.points.stop],
            }
            for c in model.layout.chains
        ],
        "polar": model.manifest["scene"]["coordinates"] == "polar",
        "names": model.names.tail,
        "eps": eps,
        "allowed": audit.allowance(info, eps),
        "remedy": audit.remedy(info),
        "why": WHY,
        "words": WORDS,
        "limits": LIMITS,
    }


def _calls(run: CompiledRun, image: Image) -> tuple[dict[str, Any], dict[str, int]]:
    """Put arrays of all samples and records of calls into an image.

    Return addresses and widths of the arrays by name, and the addresses of the records.
    """
    times, functions = run.runs.start.times, run.runs.records.code.manifest["functions"]
    known = {
        name: (image.at(getattr(run.record, f"{name}_out")), array.shape[2])
        for name, array in run.runs.out.items()
        if hasattr(run.record, f"{name}_out")
    }
    for legs in run.runs.ground.legs_at(times):
        for name, width in (("legs", legs.shape[1]), ("angles", ground.LEG_ANGLES)):
            known[name] = image.put(legs[:, :width].tobytes()), width
    calls = {}
    for name in CALLED:
        inputs = [
            each["name"] for each in functions.get(name, {"inputs": [{"name": ""}]})["inputs"]
        ]
        if not known.keys() >= set(inputs):
            continue
        for each in functions[name]["outputs"]:
            width = int(np.prod(each["shape"]))
            place = image.put(bytes(REAL * width * len(times)))
            known[f"{name}.{each['name']}"] = place, width
            inputs.append(f"{name}.{each['name']}")
        work = image.put(bytes(REAL * run.runs.records.code.manifest["work"][name]))
        call = [image.at(run.record.parameters), 0, 0, work, *(known[each][0] for each in inputs)]
        calls[name] = image.put(np.array(call + [0] * (4 + ARRAYS - len(call)), "<u4").tobytes())
    return known, calls

"""Status 0 implies finite outputs: of every function, for every argument, by every compiler."""

from collections import Counter
from itertools import product

import pytest

from serpentail_codegen.scene.signatures.table import VALUES

from ...support.models import model_folder
from ...support.toolchains import clang
from .hostile import NOT_FINITE, NOT_POSITIVE_DEFINITE, OK, OUT_OF_RANGE, attacked

GROUND = {"functions": "all", "contacts": ["feet", "tail", "torso"]}
POLAR = {"coordinates": "polar", "functions": list(VALUES), "contacts": []}  # all that it has
MODELS = {
    "straight": ((1, 1), {"emission": "straight"}),
    "loops": ((1, 2), {"emission": "loops", "real": "float"}),
    "chosen": ((2, 2), {}),
    "lanes": ((2, 2), {"emission": "lanes"}),
    "segments": ((2, 2), {"emission": "segments"}),
    "segments_float": ((2, 2), {"emission": "segments", "real": "float"}),
    "straight_float": ((1, 2), {"emission": "straight", "real": "float"}),
    "baked": ((1, 2), {"baked": True}),
    "baked_loops": ((2, 1), {"baked": True, "emission": "loops"}),
    "reproducible": ((1, 2), {"profile": "reproducible"}),
    "continuum": ((1, None), {"emission": "straight"}),
    "continuum_loops": ((2, None), {"emission": "loops"}),
    "continuum_float": ((2, None), {"real": "float"}),
    "continuum_baked": ((2, None), {"baked": True, "emission": "lanes"}),
    "polar": ((2, None), POLAR),
    "polar_loops": ((1, None), {**POLAR, "emission": "loops", "real": "float"}),
}
FAST = ("-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math", "-march=native")
LEVELS = (("-O0",), ("-O1",), ("-O2",), ("-O3",), ("-O2", *FAST))
COMMANDS = list(product(("gcc", "clang"), LEVELS))


def cases():
    """Every model by a compiler and a level, each pair of those by several models; two quick."""
    for k, name in enumerate(MODELS):
        for compiler, level in (COMMANDS[k % len(COMMANDS)], COMMANDS[(k + 7) % len(COMMANDS)]):
            quick = (name, compiler, level) in QUICK
            marks = () if quick else pytest.mark.slow
            yield pytest.param(name, compiler, level, marks=marks, id=f"{name}{compiler}{level}")


QUICK = [("straight", "gcc", ("-O0",)), ("loops", "gcc", ("-O1",))]


def folder(name):
    """The generated folder of a model with every function."""
    size, options = MODELS[name]
    return model_folder(*size, name=f"{name}_law", **(GROUND | options))


@pytest.mark.parametrize(("name", "compiler", "level"), list(cases()))
def test_status_ok_implies_finite_outputs(name, compiler, level):
    if compiler == "clang":
        clang()
    told, count, broken = Counter(), 0, []
    for call in attacked(folder(name), (compiler, *level)):
        count += 1
        told[call.status] += 1
        broken += [] if call.lawful else [call]
        assert call.put or call.status == OK, call  # what is ordinary is answered
    print(f"\n{name}, {compiler} {' '.join(level)}: {count} calls, {dict(told)}")
    assert not broken, f"{len(broken)} of {count} calls, such as {broken[:5]}"
    assert count > 5000 and {OK, NOT_FINITE, NOT_POSITIVE_DEFINITE} <= told.keys()
    assert (OUT_OF_RANGE in told) == name.startswith(("continuum", "polar"))

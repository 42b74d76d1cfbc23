"""Status 0 implies finite outputs: of every function, for every argument, by every compiler; and
compilers that would delete the checks are refused.
"""

import ctypes
import os
import subprocess
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
import pytest

from tests.support import zoo
from tests.support.rows import row
from tests.support.toolchains import clang

from .target.emitted import Library, model_of

OK, NOT_POSITIVE_DEFINITE, NOT_FINITE, OUT_OF_RANGE = range(4)
VALUES = {
    "double": (
        *(np.nan, np.inf, -np.inf, 1e308, -1e308, 1e200, -1e155, 1e100, -1e20, 1e9),
        *(5e-324, -1e-310, 1e-200, 0.0, -0.0, -1.0),
    ),
    "float": (
        *(np.nan, np.inf, -np.inf, 3e38, -3e38, 1e30, -1e20, 1e15, -1e10, 1e9),
        *(1e-45, -1e-39, 1e-30, 0.0, -0.0, -1.0),
    ),
}
# by the size of w: zero, underflow, overflow, and what would pass for another attitude
QUATERNIONS = {
    "double": ((0, 0, 0, 0), (1e-170, 0, 0, 0), (0, 1e-160, 1e-162, 0), (1e155, 1e152, 0, 0)),
    "float": ((0, 0, 0, 0), (1e-25, 0, 0, 0), (0, 1e-21, 1e-23, 0), (1e20, 1e17, 0, 0)),
}
MIXTURES = 40  # of several values, for each function


@dataclass(frozen=True)
class Call:
    """What was put in where, what status came back, and whether all outputs are finite."""

    function: str
    put: tuple
    status: int
    finite: bool
    refused: bool  # by the law's second half: an argument is no number, or there is no attitude

    @property
    def lawful(self) -> bool:
        """Whether status 0 comes with finite outputs, and what must be refused is."""
        known = self.status in (OK, NOT_POSITIVE_DEFINITE, NOT_FINITE, OUT_OF_RANGE)
        told = self.status == NOT_FINITE or not self.refused
        return known and told and (self.finite or self.status != OK)


class Function:
    """One function of a library, with arguments that can be changed in place."""

    def __init__(self, library: Library, name: str, inputs: dict[str, np.ndarray]):
        manifest, number = library.model.manifest, library.number
        self.name, self.inputs, self.parameters = name, inputs, library.parameters
        outputs = manifest["functions"][name]["outputs"]
        self.outputs = [np.zeros(np.prod(a["shape"], dtype=int), number) for a in outputs]
        self.work = np.zeros(manifest["work"][name] + 1, number)
        arrays = (self.parameters, *inputs.values(), *self.outputs, self.work)
        self.pointers = [ctypes.c_void_p(a.ctypes.data) for a in arrays]
        self.function = library.library[f"{library.model.name}_{name}"]

    def call(self, put: tuple = (), refused: bool = False) -> Call:
        """Call it; what it does not write is finite no longer."""
        for array in self.outputs:
            array.fill(np.nan)
        status = self.function(*self.pointers)
        finite = all(np.isfinite(array).all() for array in self.outputs)
        return Call(self.name, put, status, finite, refused)

    def with_put(self, changes: list[tuple], refused: bool = False) -> Call:
        """Call it with some entries changed, then change them back."""
        arrays = self.inputs | {"parameters": self.parameters}
        before = [arrays[name][k] for name, k, _ in changes]
        for name, k, value in changes:
            arrays[name][k] = value
        # what solves with factors reads those of them that matter
        checked = [x for name, _, x in changes if name not in ("parameters", "factors")]
        refused = refused or not np.isfinite(checked).all()
        found = self.call(tuple((name, k, float(x)) for name, k, x in changes), refused)
        for (name, k, _), value in reversed(list(zip(changes, before, strict=True))):
            arrays[name][k] = value
        return found

    def calls(self, real: str, baked: bool, rng) -> Iterator[Call]:
        """Yield calls: ordinary, one value anywhere, no attitude, mixtures."""
        yield self.call()
        arrays = self.inputs | ({} if baked else {"parameters": self.parameters})
        places = [(name, k) for name, array in arrays.items() for k in range(len(array))]
        for place in places:
            for value in VALUES[real]:
                yield self.with_put([(*place, value)])
        for quaternion in QUATERNIONS[real] if "q" in arrays else ():
            put = [("q", 3 + k, x) for k, x in enumerate(quaternion)]
            yield self.with_put(put, refused=True)
        for _ in range(MIXTURES):
            chosen = rng.choice(len(places), min(len(places), rng.integers(2, 6)), False)
            values = rng.choice(VALUES[real], len(chosen))
            yield self.with_put([(*places[k], x) for k, x in zip(chosen, values, strict=True)])


def ordinary(name: str, length: int, rng) -> np.ndarray:
    """Return an argument as it should be."""
    x = rng.uniform(-0.5, 0.5, length)
    if name == "q":
        x[3:7] += (1, 0, 0, 0)
        x[7:] = abs(x[7:]) + 0.1  # polar angles are above zero
    return abs(x) * 1e-3 if name in ("damping", "gains", "weight") else x


def attacked(name: str, compiler: str, level: tuple[str, ...]) -> Iterator[Call]:
    """Yield calls of every function of a model with hostile values."""
    model, rng, known = model_of(name), np.random.default_rng(0), {}
    library = Library(model, *level, compiler=compiler)
    for function, entry in model.manifest["functions"].items():
        sizes = {a["name"]: np.prod(a["shape"], dtype=int) for a in entry["inputs"]}
        drawn = {key: ordinary(key, size, rng) for key, size in sizes.items()} | known
        inputs = {key: drawn[key].astype(library.number) for key in sizes}
        one = Function(library, function, inputs)
        yield from one.calls(model.scene.real, model.scene.baked, rng)
        if function == "implicit_factor":
            assert one.call().status == OK
            known["factors"] = one.outputs[0]


FAST = ("-O2", "-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math", "-march=native")
# every form, real type, kind of tail and option; every compiler and level
QUICK = [("small", "gcc", ("-O1",)), ("bare", "gcc", ("-O0",))]
SLOW = [
    ("m1_n1", "gcc", ("-O0",)),
    ("ground_m1_n1", "clang", ("-O0",)),
    ("loops", "gcc", ("-O1",)),
    ("polar", "gcc", FAST),
    ("polar", "clang", ("-O3",)),
    ("bare", "gcc", ("-O3",)),
    ("arcs1", "clang", ("-O1",)),
    ("segments", "clang", FAST),
    ("small", "clang", ("-O2",)),
    ("small", "gcc", ("-O2",)),
    ("baked", "gcc", ("-O0",)),
]


@pytest.mark.parametrize(
    ("name", "compiler", "level"),
    [*QUICK, *(pytest.param(*case, marks=pytest.mark.slow) for case in SLOW)],
)
def test_status_ok_implies_finite_outputs(name, compiler, level):
    if compiler == "clang":
        clang()
    told, count, broken = Counter(), 0, []
    for call in attacked(name, compiler, level):
        count += 1
        told[call.status] += 1
        broken += [] if call.lawful else [call]
        assert call.put or call.status == OK, call  # what is ordinary is answered
    assert not broken, f"{len(broken)} of {count} calls, such as {broken[:5]}"
    assert count > 500 and {OK, NOT_FINITE, NOT_POSITIVE_DEFINITE} <= told.keys()
    assert (OUT_OF_RANGE in told) == (name in ("polar", "arcs1"))


def test_every_file_that_computes_refuses_fast_mathematics():
    clang()
    for name, parts in (("small", "*"), ("m1_n1", "*_flights")):
        folder = zoo.folder(name)
        sources = sorted((folder / "src").glob(f"{parts}.c"))
        assert len(sources) == (6 if parts == "*" else 1)
        flags = ("", "-ffast-math", "-Ofast", "-ffinite-math-only")
        for source, compiler, flag in product(sources, ("gcc", "clang"), flags):
            command = [compiler, "-std=c99", "-O2", *flag.split(), "-E", "-o", os.devnull]
            command += [str(source), "-I", str(folder / "include")]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            with row(source.name, compiler, flag):
                refused = f"{name} checks for NaN and infinity" in done.stderr
                assert refused == (done.returncode != 0) == (flag != "")
                assert refused or done.stderr == ""

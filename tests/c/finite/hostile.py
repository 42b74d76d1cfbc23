"""Calls the bare functions of a compiled model with values far from ordinary, one or several at a
time.
"""

import ctypes
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...support.compile_once import compile_once

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


class Victim:
    """A model's functions, compiled by a command, with arguments that can be changed in place."""

    def __init__(self, folder: Path, command: tuple[str, ...], seed: int = 0):
        self.manifest = json.loads((folder / "manifest.json").read_text())
        self.name, self.rng = self.manifest["prefix"], np.random.default_rng(seed)
        self.real, self.baked = self.manifest["real"], self.manifest["scene"].get("baked", False)
        self.dtype = np.float32 if self.real == "float" else np.float64
        source, flags = folder / "src" / f"{self.name}.c", ("-std=c99", "-shared", "-fPIC")
        path = compile_once("bare.so", (*command, *flags), [source], folder / "include")
        self.library, self.factors = ctypes.CDLL(str(path)), None
        self.parameters = self.ordinary_parameters()

    def ordinary_parameters(self) -> np.ndarray:
        """Return the scene's parameters."""
        sizes = [p["size"] for p in self.manifest["parameters"] if p["in_struct"]]
        parameters = np.zeros(sum(sizes), self.dtype)
        self.library[f"{self.name}_default_parameters"](ctypes.c_void_p(parameters.ctypes.data))
        return parameters

    def ordinary(self, name: str, length: int) -> np.ndarray:
        """Return an argument as it should be."""
        x = self.rng.uniform(-0.5, 0.5, length).astype(self.dtype)
        if name == "q":
            x[3:7] += (1, 0, 0, 0)
            x[7:] = abs(x[7:]) + self.dtype(0.1)  # polar angles are above zero
        if name in ("damping", "gains", "weight"):
            x = abs(x) * self.dtype(1e-3)
        return self.factors.copy() if name == "factors" else x

    def calls(self, function: str) -> Iterator[Call]:
        """Yield calls of a function: ordinary, one value anywhere, no attitude, mixtures."""
        one = Function(self, function)
        yield one.call((), False)
        arrays = one.inputs | ({} if self.baked else {"parameters": self.parameters})
        for name, array in arrays.items():
            for k in range(len(array)):
                for value in VALUES[self.real]:
                    yield one.with_put([(name, array, k, value)])
        if "q" in one.inputs:
            for quaternion in QUATERNIONS[self.real]:
                put = [("q", one.inputs["q"], 3 + k, x) for k, x in enumerate(quaternion)]
                yield one.with_put(put, refused=True)
        places = [(name, array, k) for name, array in arrays.items() for k in range(len(array))]
        for _ in range(MIXTURES):
            chosen = self.rng.choice(len(places), min(len(places), self.rng.integers(2, 6)), False)
            values = self.rng.choice(VALUES[self.real], len(chosen))
            yield one.with_put([(*places[k], x) for k, x in zip(chosen, values, strict=True)])


class Function:
    """One function of a model, and the arrays that it is called with."""

    def __init__(self, victim: Victim, name: str):
        entry = victim.manifest["functions"][name]
        sizes = {a["name"]: int(np.prod(a["shape"])) for a in entry["inputs"]}
        self.name, self.inputs = name, {n: victim.ordinary(n, size) for n, size in sizes.items()}
        self.outputs = [np.zeros(np.prod(a["shape"]), victim.dtype) for a in entry["outputs"]]
        self.work = np.zeros(victim.manifest["work"][name] + 1, victim.dtype)
        arrays = (victim.parameters, *self.inputs.values(), *self.outputs, self.work)
        self.pointers = [ctypes.c_void_p(a.ctypes.data) for a in arrays]
        self.function = victim.library[f"{victim.name}_{name}"]

    def call(self, put: tuple, refused: bool) -> Call:
        """Call it; what it does not write is finite no longer."""
        for array in self.outputs:
            array.fill(np.nan)
        status = self.function(*self.pointers)
        finite = all(np.isfinite(array).all() for array in self.outputs)
        return Call(self.name, put, status, finite, refused)

    def with_put(self, changes: list[tuple], refused: bool = False) -> Call:
        """Call it with some entries changed, then change them back."""
        before = [array[k] for _, array, k, _ in changes]
        for _, array, k, value in changes:
            array[k] = value
        # what solves with factors reads those of them that matter
        checked = [x for name, _, _, x in changes if name not in ("parameters", "factors")]
        refused = refused or not np.isfinite(checked).all()
        found = self.call(tuple((name, k, float(x)) for name, _, k, x in changes), refused)
        for (_, array, k, _), value in reversed(list(zip(changes, before, strict=True))):
            array[k] = value
        return found


def attacked(folder: Path, command: tuple[str, ...], seed: int = 0) -> Iterator[Call]:
    """Yield calls of every function of a model with hostile values."""
    victim = Victim(folder, command, seed)
    for name in victim.manifest["functions"]:
        yield from victim.calls(name)
        if name == "implicit_factor":
            factor = Function(victim, name)
            assert factor.call((), False).status == OK
            victim.factors = factor.outputs[0]

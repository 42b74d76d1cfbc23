"""Pinocchio's forward dynamics of the same tails and its Jacobians, as documented and tuned."""

import ctypes
from collections.abc import Mapping
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.peers.build import PeerUnavailable, build_library, by_each
from benchmarks.timing import Closure, pointer

HERE = Path(__file__).parent
# figures for these are at the top of pinocchio_tuned.cpp; clang has no more of them
BY_GCC = ("-fno-tree-slp-vectorize", "-finline-limit=2000")
BY_GCC += ("--param=inline-unit-growth=400", "--param=large-function-growth=2000")
TUNED: dict = {"by_gcc": BY_GCC, "by_clang": ("-fno-slp-vectorize",)}
# in the order of the array that pinocchio_chain_new takes
PARAMETERS = ("gravity", "torso_mass", "torso_inertia", "tail_mount", "tail_mass", "tail_length")
PARAMETERS += ("link_inertia",)


class PinocchioChain:
    """An articulated tail in one library of Pinocchio; the timer calls its closures."""

    def __init__(self, library: Path, size: tuple[int, int], parameters: Mapping, function: str):
        """Build the chain from parameters by name (SI), link_inertia among them.

        function: what is timed, "forward_dynamics" or "forward_dynamics_derivatives".
        """
        self.library, self.nv = ctypes.CDLL(str(library)), 6 + 2 * size[0]
        self.function = function
        self.library.pinocchio_chain_new.restype = ctypes.c_void_p
        values = np.hstack([parameters[name] for name in PARAMETERS])
        self.chain = self.library.pinocchio_chain_new(*size, ctypes.c_void_p(pointer(values)))
        if not self.chain:
            raise PeerUnavailable(f"Pinocchio could not build a chain of {size} links")

    @property
    def closure(self) -> Closure:
        """What the timer calls."""
        address = ctypes.cast(getattr(self.library, f"pinocchio_{self.function}"), ctypes.c_void_p)
        return Closure(address.value, self.chain)

    def forward_dynamics(self, q, v, tau) -> np.ndarray:
        """Return v_dot (nv), torso first, in world axes."""
        v_dot = np.empty(self.nv)
        if self._call(self.function, *map(np.ascontiguousarray, (q, v, tau)), v_dot):
            raise FloatingPointError("Pinocchio: the mass matrix is not positive definite")
        return v_dot

    def jacobians(self, q, v, tau) -> tuple[np.ndarray, ...]:
        """Return dq (nv, nv), dv (nv, nv) and dtau (nv, nv - 6), all relative to the torso."""
        self.forward_dynamics(q, v, tau)
        results = tuple(np.empty((self.nv, columns)) for columns in (self.nv, self.nv, self.nv - 6))
        self._call("derivatives_result", *results)
        return results

    def free(self) -> None:
        """Free the chain; its closures must not be called any more."""
        self._call("chain_free")

    def _call(self, name: str, *arrays: np.ndarray) -> int:
        addresses = [ctypes.c_void_p(pointer(array)) for array in arrays]
        return getattr(self.library, f"pinocchio_{name}")(ctypes.c_void_p(self.chain), *addresses)


def chains(
    freed: ExitStack, model: st.Model, function: str
) -> dict[str, dict[str, PinocchioChain]]:
    """Return the chain of a model as documented and tuned, by compiler; the stack frees them."""
    flags = ("-DJACOBIANS",) if function == "forward_dynamics_derivatives" else ()
    sources = {
        "Pinocchio": partial(build_library, HERE / "pinocchio_plain.cpp"),
        "Pinocchio tuned": partial(
            build_library, HERE / "pinocchio_tuned.cpp", flags=flags, **TUNED
        ),
    }
    size, found = (model.segments, model.links), {}
    for name, make in sources.items():
        found[name] = {
            by: PinocchioChain(library, size, model.parameters, function)
            for by, library in by_each(make).items()
        }
        for chain in found[name].values():
            freed.callback(chain.free)
    return found

"""Pinocchio's forward dynamics of the same tails, in several configurations, for timing."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from .compilers import PeerUnavailable
from .timing import Closure, pointer

# In the order of the array that pinocchio_chain_new takes.
PARAMETERS = (
    "gravity",
    "torso_mass",
    "torso_inertia",
    "tail_mount",
    "tail_mass",
    "tail_length",
    "link_inertia",
)


class PinocchioBench:
    """The articulated tail in Pinocchio: v_dot, H and C of one state, and closures for the
    timer.
    """

    def __init__(self, segments: int, links: int, parameters: Mapping, library: Path):
        """Build the chain from parameters by name (SI), link_inertia among them."""
        self.nv = 6 + 2 * segments
        self._library = _declared(library)
        values = np.hstack([parameters[name] for name in PARAMETERS])
        self._chain = self._library.pinocchio_chain_new(segments, links, pointer(values))
        if not self._chain:
            raise PeerUnavailable(
                f"Pinocchio could not build a chain of {segments} x {links} links."
            )

    @property
    def closure(self) -> Closure:
        """The fastest path to v_dot."""
        return self._closure("pinocchio_forward_dynamics")

    @property
    def crba_closure(self) -> Closure:
        """The path through Pinocchio's CRBA of the full chain."""
        return self._closure("pinocchio_forward_dynamics_crba")

    @property
    def derivatives_closure(self) -> Closure:
        """The path to the Jacobians of v_dot through computeRNEADerivatives; of PLAIN and
        DERIVATIVES.
        """
        return self._closure("pinocchio_forward_dynamics_derivatives")

    @property
    def own_derivatives_closure(self) -> Closure:
        """The path to the Jacobians of v_dot by own sums; of DERIVATIVES."""
        return self._closure("pinocchio_forward_dynamics_derivatives_own")

    def forward_dynamics_derivatives(self, q, v, tau, path: str = "") -> tuple[np.ndarray, ...]:
        """Jacobians of v_dot, all relative to the torso: dq (nv, nv), dv (nv, nv), dtau (nv, nv -
        6); path: "_own".
        """
        self._call(f"pinocchio_forward_dynamics_derivatives{path}", (self.nv,), q, v, tau)
        results = tuple(np.empty((self.nv, columns)) for columns in (self.nv, self.nv, self.nv - 6))
        self._library.pinocchio_derivatives_result(self._chain, *map(pointer, results))
        return results

    def forward_dynamics(self, q, v, tau) -> np.ndarray:
        """v_dot (nv) by the fastest path."""
        return self._call("pinocchio_forward_dynamics", (self.nv,), q, v, tau)

    def forward_dynamics_crba(self, q, v, tau) -> np.ndarray:
        """v_dot (nv) by the path through CRBA."""
        return self._call("pinocchio_forward_dynamics_crba", (self.nv,), q, v, tau)

    def mass_matrix(self, q) -> np.ndarray:
        """H (nv, nv)."""
        return self._call("pinocchio_mass_matrix", (self.nv, self.nv), q)

    def bias_force(self, q, v) -> np.ndarray:
        """C (nv), gravity included."""
        return self._call("pinocchio_bias_force", (self.nv,), q, v)

    def close(self) -> None:
        """Free the chain; closures of it must not be called any more."""
        self._library.pinocchio_chain_free(self._chain)
        self._chain = None

    def __enter__(self) -> PinocchioBench:
        """Return itself."""
        return self

    def __exit__(self, *_error) -> None:
        """Free the chain."""
        self.close()

    def _closure(self, name: str) -> Closure:
        return Closure(
            ctypes.cast(getattr(self._library, name), ctypes.c_void_p).value, self._chain
        )

    def _call(self, name: str, shape: tuple[int, ...], *inputs) -> np.ndarray:
        arrays = [np.ascontiguousarray(x, dtype=float) for x in inputs]
        out = np.empty(shape)
        if getattr(self._library, name)(self._chain, *map(pointer, arrays), pointer(out)):
            raise FloatingPointError(f"{name}: the mass matrix is not positive definite")
        return out


def chains(freed: ExitStack, made: Mapping[str, Path], size, ours) -> dict[str, PinocchioBench]:
    """Return the chain of a fixture in each library, by compiler; the stack frees them."""
    return {
        by: freed.enter_context(PinocchioBench(*size, ours.parameters, library))
        for by, library in made.items()
    }


def _declared(path: Path) -> ctypes.CDLL:
    """Return the library of a Pinocchio source; every pointer is passed as an address."""
    library = ctypes.CDLL(str(path))
    library.pinocchio_chain_new.restype = ctypes.c_void_p
    library.pinocchio_chain_new.argtypes = [ctypes.c_int, ctypes.c_int, ctypes.c_void_p]
    library.pinocchio_chain_free.restype = None
    pointers = {"chain_free": 1, "mass_matrix": 3, "bias_force": 4}
    pointers |= {
        "forward_dynamics": 5,
        "forward_dynamics_crba": 5,
        "forward_dynamics_derivatives": 5,
    }
    pointers |= {"forward_dynamics_derivatives_own": 5, "derivatives_result": 4}
    for name in (name for name in pointers if hasattr(library, f"pinocchio_{name}")):
        getattr(library, f"pinocchio_{name}").argtypes = [ctypes.c_void_p] * pointers[name]
    return library

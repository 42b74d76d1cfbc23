"""Derivatives in C beside Pinocchio's and CasADi's: run times, sizes and build times."""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("derivatives", __doc__)

import resource
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import numpy as np

import serpentail as st
from serpentail.building.generator import generate
from serpentail.compiling.compiler import compile_library
from serpentail_scene.signatures.table import DERIVATIVES

from .comparison import compared
from .fixtures import by_clang, fixture, label
from .peers import build, pinocchio, timing
from .peers.casadi_derivatives import IN_SX, InCasadi, hessian, in_casadi, jacobians

SIZES = ((1, 3), (3, 4), (6, 6))
ROUNDS, CALLS = 200, 64
JACOBIANS, HESSIAN = "forward_dynamics_derivatives", "inverse_dynamics_hessian"


# ---- models and closures -------------------------------------------------------------------------


def generated(parent: Path, size: tuple[int, int], functions, emission: str = "auto") -> Path:
    """Generate an articulated tail with some functions; return the generated folder."""
    name = f"{functions[-1]}_m{size[0]}_n{size[1]}"
    scene = parent / f"{name}.toml"
    lines = [
        'kind = "articulated"',
        f"segments = {size[0]}",
        f"links = {size[1]}",
        f"functions = {list(functions)}",
    ]
    scene.write_text("\n".join([*lines, f'emission = "{emission}"', ""]))
    return generate(scene, parent / f"made_{name}")


# ---- measures ------------------------------------------------------------------------------------


def jacobian_times(folder: Path) -> list[dict]:
    """Nanoseconds of the Jacobians of v_dot from (q, v, tau), forward dynamics included, rounds
    interleaved; each peer by the faster of the compilers.

    Ratios by minima (by medians in brackets).  Pinocchio, full chain of 2 m n revolutes: v_dot,
    computeRNEADerivatives there, G^T (...) G, Cholesky; as its documentation shows it, and with all
    that was found to speed it up (pinocchio_derivatives.cpp); own sums over the tied columns on its
    types.  CasADi: C of the SX graph of -H^-1 dID, cse, -O2, by its Jacobian along all directions
    and with the columns of a turn written by hand; it writes no column that is zero throughout.
    Differences: of the documented path, which loses two digits as B is a metre from the origin; the
    largest of the others.  Ours is compiled as its users have it, and by clang beside that.
    """
    plain, tuned = (
        build.by_each(partial(build.build_library, source, build.CACHE))
        for source in (build.PLAIN, build.DERIVATIVES)
    )
    return [jacobian_row(folder, size, plain, tuned) for size in SIZES]


def jacobian_row(folder: Path, size: tuple[int, int], plain: dict, tuned: dict) -> dict:
    """Measure one size; the libraries by compiler."""
    ours = fixture(st.load(generated(folder, size, (*IN_SX, JACOBIANS))), folder, JACOBIANS)
    by_hand = in_casadi("by_hand", jacobians(ours.model, True), ours.model, folder)
    by_itself = in_casadi("by_itself", jacobians(ours.model, False), ours.model, folder)
    states = timing.random_states(size[0])
    with ExitStack() as freed:
        plain, tuned = (pinocchio.chains(freed, made, size, ours) for made in (plain, tuned))
        peers = {
            "plain": {by: peer.derivatives_closure for by, peer in plain.items()},
            "revolutes": {by: peer.derivatives_closure for by, peer in tuned.items()},
            "own": {by: peer.own_derivatives_closure for by, peer in tuned.items()},
            "casadi": {by: peer.closure for by, peer in by_itself.items()},
            "hand": {by: peer.closure for by, peer in by_hand.items()},
        }
        row = {"model": label(*size)} | compared(
            ours, peers, states, ROUNDS, CALLS, by_clang(ours.model, folder, JACOBIANS)
        )
        first = pinocchio_difference(ours.model, next(iter(plain.values())), states)
        errors = [
            pinocchio_difference(ours.model, peer, states, path)
            for peer in tuned.values()
            for path in ("", "_own")
        ]
    casadi = (*by_itself.values(), *by_hand.values())
    errors += [casadi_difference(ours.model, peer, states) for peer in casadi]
    return row | {"plain_difference": first, "jacobian_difference": max(errors)}


def pinocchio_difference(
    model: st.Model, peer: pinocchio.PinocchioBench, states: timing.States, path: str = ""
) -> float:
    """Largest difference in the rows of omega and the tail, whose columns are the same relative to
    the torso.
    """
    errors = []
    for state in zip(*states, strict=True):
        found = peer.forward_dynamics_derivatives(*state, path)
        for a, b, first in zip(
            model.forward_dynamics_derivatives(*state), found, (6, 3, 0), strict=True
        ):
            errors.append(difference(a[3:, first:], b[3:, first:]))
    return max(errors)


def casadi_difference(model: st.Model, peer: InCasadi, states: timing.States) -> float:
    """Largest difference of all entries that are not zero."""
    nt, errors = model.nv - 6, []
    for state in zip(*states, strict=True):
        dq, dv, dtau = model.forward_dynamics_derivatives(*state)
        rest, turn = peer(*state)
        parts = np.hsplit(rest, (nt, 2 * nt + 3))
        turn = np.vstack([turn, np.zeros((model.nv - len(turn), 3))])
        pairs = [(dq[:, 3:], np.hstack([turn, parts[0]])), (dv[:, 3:], parts[1]), (dtau, parts[2])]
        errors += [difference(*pair) for pair in pairs]
    return max(errors)


def difference(a: np.ndarray, b: np.ndarray) -> float:
    """Largest difference of two blocks, relative to the largest entry."""
    return float(np.abs(a - b).max() / np.abs(a).max())


def hessian_times(folder: Path) -> list[dict]:
    """Nanoseconds of the Hessian of lambda^T (H v_dot + C) from C, rounds interleaved. Ours writes
    four square blocks, including zeros and both triangles of symmetric ones. CasADi: SX, Jacobian
    of the gradient; cse, -O2, by the faster of the compilers. In like terms: the same four blocks.
    Its nonzeros: those of the lower triangle and of the mixed block, fewer than ours gives. Ratios
    by minima (by medians in brackets). Ours compiled by clang is beside it.
    """
    rows = []
    for size in SIZES[:2]:
        ours = fixture(st.load(generated(folder, size, (*IN_SX, HESSIAN))), folder, HESSIAN)
        states = multiplied(timing.random_states(size[0]))
        alike, sparse = (
            in_casadi(name, hessian(ours.model, name == "dense"), ours.model, folder)
            for name in ("dense", "sparse")
        )
        peers = {
            "casadi": {by: peer.closure for by, peer in alike.items()},
            "sparse": {by: peer.closure for by, peer in sparse.items()},
        }
        row = {"model": label(*size)} | compared(
            ours, peers, states, ROUNDS, CALLS, by_clang(ours.model, folder, HESSIAN)
        )
        errors = [hessian_difference(ours.model, peer, states) for peer in sparse.values()]
        errors += [block_difference(ours.model, peer, states) for peer in alike.values()]
        rows.append(row | {"hessian_difference": max(errors)})
    return rows


def block_difference(model: st.Model, peer: InCasadi, states: timing.States) -> float:
    """Largest difference in the four blocks."""
    errors = []
    for q, v, both in zip(*states, strict=True):
        blocks = model.inverse_dynamics_hessian(q, v, *np.split(both, 2))
        errors.append(difference(np.hstack(blocks), peer(q, v, both)[0]))
    return max(errors)


def multiplied(states: timing.States) -> timing.States:
    """The states with an acceleration and multipliers instead of torques."""
    rng = np.random.default_rng(0)
    shape = states.v.shape
    return states._replace(tau=np.hstack([rng.uniform(-100, 100, shape), rng.normal(size=shape)]))


def hessian_difference(model: st.Model, peer: InCasadi, states: timing.States) -> float:
    """Largest difference in the lower triangle and the mixed block."""
    errors = []
    for q, v, both in zip(*states, strict=True):
        qq, qv, vv, aq = model.inverse_dynamics_hessian(q, v, *np.split(both, 2))
        whole = np.block([[qq[3:, 3:], qv[3:, 3:]], [qv[3:, 3:].T, vv[3:, 3:]]])
        second, mixed = peer(q, v, both)
        errors += [difference(np.tril(whole), second), difference(aq[:, 3:], mixed)]
    return max(errors)


def derivative_code(folder: Path) -> list[dict]:
    """All ten derivative functions as loops: operations that a call executes, size of their C,
    processor seconds. Generation is measured as one process from its start; compilation is the
    whole time of the compiler, with the runtime's flags.
    """
    rows = []
    for size in (*SIZES, (8, 16)):
        before = children_seconds()
        model = generated(folder, size, DERIVATIVES, "loops")
        generated_in = children_seconds() - before
        sources = [model / "src" / f"{model.name}{ending}.c" for ending in ("", "_host")]
        before = children_seconds()
        compile_library(sources, model / "include", cache=folder / f"empty_{model.name}")
        spent = children_seconds() - before
        counts = st.load(model, compiled=False).manifest["functions"]
        row = {"model": f"({size[0]}, {size[1]})"}
        row |= {
            f"{name}_operations": counts[name]["operations"]
            for name in (JACOBIANS, "inverse_dynamics_derivatives", HESSIAN)
        }
        row |= {
            "derivative_bytes": sources[0].stat().st_size,
            "generate_cpu": generated_in,
            "compile_cpu": spent,
        }
        rows.append(row)
    return rows


def children_seconds() -> float:
    """Processor seconds of all processes started here that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime

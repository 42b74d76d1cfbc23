"""Times MuJoCo and CasADi on the same forward dynamics as the generated C."""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("peers.mujoco_casadi", __doc__)

import ctypes
import importlib.util
from contextlib import ExitStack
from pathlib import Path

import casadi as ca
import numpy as np

from benchmarks.comparison import compared
from benchmarks.fixtures import built, fixture, label
from benchmarks.peers import build, casadi_derivatives, timing
from benchmarks.peers.compilers import Compiler

SIZES = ((1, 3), (3, 4), (6, 6))
IN_CASADI = ((1, 3), (3, 4))  # compilers take minutes for longer tails


def other_peers(folder: Path) -> list[dict]:
    """Nanoseconds of forward dynamics beside MuJoCo's and CasADi's, rounds interleaved; ratios by
    minima (by medians); each peer by the faster of the compilers. MuJoCo: the full chain of 2 m n
    hinges. Its own compiled functions give inertia and bias, which are reduced and solved as
    Pinocchio's are (mujoco_chain.c). CasADi: C of the generated SX function, -O2, as in its
    documentation.
    """
    libraries = build.by_each(mujoco_library)
    return [row(folder, size, libraries) for size in SIZES]


def row(folder: Path, size: tuple[int, int], libraries: dict[str, ctypes.CDLL]) -> dict:
    """Return the figures of one tail."""
    ours = fixture(built(*size), folder)
    states, xml = timing.random_states(size[0]), chain_xml(folder, ours.model)
    with ExitStack() as freed:
        peers = {"mujoco": {}}
        for name, library in libraries.items():
            chain = library.mujoco_chain_new(str(xml).encode(), *size)
            if not chain:
                raise build.PeerUnavailable("MuJoCo could not read the chain")
            freed.callback(library.mujoco_chain_free, chain)
            pointer = ctypes.cast(library.mujoco_forward_dynamics, ctypes.c_void_p).value
            peers["mujoco"][name] = timing.Closure(pointer, chain)
        error = difference(library, chain, ours.model, states)
        if size in IN_CASADI:
            found = casadi_derivatives.in_casadi("fd", acceleration(ours.model), ours.model, folder)
            peers["casadi"] = {name: peer.closure for name, peer in found.items()}
        measured = compared(ours, peers, states)
    return {"model": label(*size)} | measured | {"v_dot_difference": error}


def acceleration(model) -> ca.Function:
    """Return v_dot of (q, v, tau, parameters), and an empty second output, because the timer's
    adapter needs two.
    """
    graph = casadi_derivatives.Graph(model)
    tau = ca.SX.sym("tau", graph.nt)
    arguments = {
        name: ca.vertsplit(x) for name, x in (("q", graph.q), ("v", graph.v), ("tau", tau))
    }
    v_dot = ca.vertcat(*graph.module.forward_dynamics(graph.fields, **arguments)["v_dot"])
    return graph.finished(tau, [v_dot, ca.SX.zeros(1)])


def mujoco_library(compiler: Compiler) -> ctypes.CDLL:
    """Compile mujoco_chain.c against the installed MuJoCo; PeerUnavailable if that is missing."""
    found = importlib.util.find_spec("mujoco")
    if found is None:
        raise build.PeerUnavailable("MuJoCo is not installed: pip install mujoco")
    home = Path(found.origin).parent
    shared = next(home.glob("libmujoco.so.*"))
    flags = ("-I", str(home / "include"), str(shared), f"-Wl,-rpath,{home}")
    source = Path(__file__).parent / "mujoco_chain.c"
    library = ctypes.CDLL(str(build.build_library(source, build.CACHE, compiler, flags)))
    library.mujoco_chain_new.restype = ctypes.c_void_p
    library.mujoco_chain_free.argtypes = [ctypes.c_void_p]
    library.mujoco_forward_dynamics.argtypes = [ctypes.c_void_p] * 5
    return library


def chain_xml(folder: Path, model) -> Path:
    """Write the chain of a model as MJCF; return the file."""
    p, count = model.parameters, model.segments * model.links
    length, inertia = p["tail_length"] / count, words(p["link_inertia"])
    body = ""
    for k in reversed(range(count)):
        place = words(p["tail_mount"]) if k == 0 else f"0 {-length!r} 0"
        body = (
            f'<body pos="{place}"><joint axis="1 0 0"/><joint axis="0 0 1"/><inertial pos="0 '
            f'{-length / 2!r} 0" '
            f'mass="{p["tail_mass"] / count!r}" diaginertia="{inertia}"/>{body}</body>'
        )
    torso = (
        f'<inertial pos="0 0 0" mass="{p["torso_mass"]!r}" '
        f'diaginertia="{words(p["torso_inertia"])}"/>'
    )
    path = folder / f"{model.name}.xml"
    path.write_text(
        '<mujoco><compiler angle="radian" balanceinertia="false"/><option gravity="0 0 '
        f'{-p["gravity"]!r}"/>'
        f"<worldbody><body><freejoint/>{torso}{body}</body></worldbody></mujoco>"
    )
    return path


def words(numbers) -> str:
    """Return numbers in the notation of MJCF."""
    return " ".join(map(repr, numbers))


def difference(library: ctypes.CDLL, chain: int, model, states: timing.States) -> float:
    """Largest relative difference of MuJoCo's v_dot from the model's."""
    errors, v_dot = [], np.zeros(model.nv)
    for q, v, tau in zip(*states, strict=True):
        arrays = [np.ascontiguousarray(x) for x in (q, v, tau)]
        library.mujoco_forward_dynamics(chain, *(a.ctypes.data for a in (*arrays, v_dot)))
        expected = model.forward_dynamics(q, v, tau)
        errors.append(np.abs(v_dot - expected).max() / np.abs(expected).max())
    return max(errors)

"""MuJoCo's forward dynamics of the full chain of hinges, reduced, as closures to time.

Its own compiled functions give inertia and bias, which are reduced and solved as Pinocchio's are
(mujoco_chain.c).
"""

import ctypes
import importlib.util
from contextlib import ExitStack
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.peers.build import Compiler, PeerUnavailable, build_library, by_each
from benchmarks.timing import Closure, States, pointer


class MujocoChain:
    """An articulated tail in MuJoCo, through one compiler's library."""

    def __init__(self, library: ctypes.CDLL, model: st.Model, xml: Path):
        """Read the chain; PeerUnavailable if MuJoCo cannot."""
        self.library, self.model = library, model
        self.chain = library.mujoco_chain_new(str(xml).encode(), model.segments, model.links)
        if not self.chain:
            raise PeerUnavailable("MuJoCo could not read the chain")

    @property
    def closure(self) -> Closure:
        """What the timer calls."""
        address = ctypes.cast(self.library.mujoco_forward_dynamics, ctypes.c_void_p).value
        return Closure(address, self.chain)

    def difference(self, states: States) -> float:
        """Return the largest relative difference of MuJoCo's v_dot from the model's."""
        errors, v_dot = [], np.zeros(self.model.nv)
        for state in zip(*states, strict=True):
            arrays = [*map(np.ascontiguousarray, state), v_dot]
            self.library.mujoco_forward_dynamics(self.chain, *map(pointer, arrays))
            expected = self.model.forward_dynamics(*state)
            errors.append(np.abs(v_dot - expected).max() / np.abs(expected).max())
        return max(errors)


def chains(freed: ExitStack, model: st.Model, folder: Path) -> dict[str, MujocoChain]:
    """Return the chain of a model by each compiler; the stack frees them."""
    xml, found = chain_xml(folder, model), {}
    for name, library in by_each(mujoco_library).items():
        found[name] = MujocoChain(library, model, xml)
        freed.callback(library.mujoco_chain_free, found[name].chain)
    return found


def mujoco_library(compiler: Compiler) -> ctypes.CDLL:
    """Compile mujoco_chain.c against the installed MuJoCo; PeerUnavailable if that is missing."""
    found = importlib.util.find_spec("mujoco")
    if found is None:
        raise PeerUnavailable("MuJoCo is not installed: pip install mujoco")
    home = Path(found.origin).parent
    shared = next(home.glob("libmujoco.so.*"))
    flags = ("-I", str(home / "include"), str(shared), f"-Wl,-rpath,{home}")
    source = Path(__file__).with_name("mujoco_chain.c")
    library = ctypes.CDLL(str(build_library(source, compiler, flags)))
    library.mujoco_chain_new.restype = ctypes.c_void_p
    library.mujoco_chain_free.argtypes = [ctypes.c_void_p]
    library.mujoco_forward_dynamics.argtypes = [ctypes.c_void_p] * 5
    return library


def chain_xml(folder: Path, model: st.Model) -> Path:
    """Write the chain of a model as MJCF; return the file."""
    p, count = model.parameters, model.segments * model.links
    length, mass, inertia = p["tail_length"] / count, p["tail_mass"] / count, p["link_inertia"]
    tail = ""
    for k in reversed(range(count)):
        place = words(p["tail_mount"]) if k == 0 else f"0 {-length!r} 0"
        link = f'pos="0 {-length / 2!r} 0" mass="{mass!r}" diaginertia="{words(inertia)}"'
        joints = '<joint axis="1 0 0"/><joint axis="0 0 1"/>'
        tail = f'<body pos="{place}">{joints}<inertial {link}/>{tail}</body>'
    torso = f'mass="{p["torso_mass"]!r}" diaginertia="{words(p["torso_inertia"])}"'
    path = folder / f"{model.name}.xml"
    path.write_text(
        '<mujoco><compiler angle="radian" balanceinertia="false"/>'
        f'<option gravity="0 0 {-p["gravity"]!r}"/><worldbody><body><freejoint/>'
        f'<inertial pos="0 0 0" {torso}/>{tail}</body></worldbody></mujoco>'
    )
    return path


def words(numbers) -> str:
    """Return numbers in the notation of MJCF."""
    return " ".join(map(repr, numbers))

"""The functions whose programs are differentiated: forces in torso axes, and their virtual power.

In torso axes nothing depends on attitude or gravity: R^T (p_b_ddot + g z) stands for p_b_ddot.
"""

from ...ir.program import Array, Ref
from ...mechanics import torso
from ...scene.signatures.arguments import FORCE, MULTIPLIER, V_DOT, Argument, Q, V
from ..draft import Draft
from ..dynamics import inertial_forces
from ..function import Function
from ..layout import OMEGA, VELOCITY, block
from ..scope import Motion, State, Vectors
from ..sweeps.pieces import attitude, mechanism
from ..sweeps.wrenches import virtual_power

POWER = Argument("power", (1,), "lambda^T (H v_dot + C)")


def assemble_core(draft: Draft, arrays: dict[str, Array]) -> None:
    """H v_dot + C in torso axes throughout, v_dot[0:3] being R^T (p_b_ddot + g z): no attitude, no
    gravity.
    """
    state = State(arrays["q"], arrays["v"])
    core_forces(draft, state, state.omega, arrays)


def assemble_inertia(draft: Draft, arrays: dict[str, Array]) -> None:
    """The core at rest: H v_dot in torso axes."""
    core_forces(draft, State(arrays["q"]), draft.zero(3), arrays)


def core_forces(draft: Draft, state: State, omega: Ref, arrays: dict[str, Array]) -> None:
    """Store H v_dot + C in torso axes."""
    v_dot = arrays["v_dot"]
    segments = mechanism(draft).prepare(draft, state, False)
    motion = Motion(omega, block(v_dot, OMEGA), block(v_dot, VELOCITY))
    inertial_forces(draft, segments, motion, v_dot, arrays["force"])


def assemble_virtual_power(draft: Draft, arrays: dict[str, Array]) -> None:
    """lambda^T (H v_dot + C) as one sum over the links, from the torso to the tip."""
    v_dot, multiplier = arrays["v_dot"], arrays["multiplier"]
    state = State(arrays["q"], arrays["v"])
    R = attitude(draft, state)
    segments = mechanism(draft).prepare(draft, state, False)

    # the torso moves by v and v_dot, and virtually by the multiplier
    p_ddot = {"R": R, "p_ddot": block(v_dot, VELOCITY)}
    a = draft.store(torso.torso_acceleration, p_ddot, a=3)
    virtual = {"w_virtual": block(multiplier, OMEGA), "u_virtual": draft.vector("u_virtual", 3)}
    p_dot = {"R": R, "p_dot": block(multiplier, VELOCITY)}
    draft.step(torso.torso_velocity, p_dot, u=virtual["u_virtual"])
    motion = {"w": state.omega, "w_dot": block(v_dot, OMEGA)}
    start = Vectors({**motion, **a, **virtual})
    virtual_power(draft, segments, start, multiplier, v_dot, arrays["power"][0])


CORE = Function("core", "H v_dot + C in torso axes", (Q, V, V_DOT), (FORCE,), assemble_core)
INERTIA = Function("inertia", "H v_dot in torso axes", (Q, V_DOT), (FORCE,), assemble_inertia)
VIRTUAL_POWER = Function(
    "virtual_power",
    "lambda^T (H v_dot + C)",
    (Q, V, V_DOT, MULTIPLIER),
    (POWER,),
    assemble_virtual_power,
)

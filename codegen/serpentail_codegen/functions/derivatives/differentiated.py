"""The functions whose programs are differentiated: forces in torso axes, and their virtual power.

In torso axes nothing depends on attitude or gravity: R^T (p_b_ddot + g z) stands for p_b_ddot.
"""

from serpentail_scene.layout import OMEGA
from serpentail_scene.signatures.arguments import FORCE, MULTIPLIER, V_DOT, Argument, Q, V

from ...ir.program import Array
from ...mechanics import airborne
from .. import dynamics, kinematics
from ..air import core_airspeed
from ..draft import Draft
from ..function import Function, signed
from ..layout import block
from ..passive import add_passive_forces, add_passive_power
from ..scope import Motion, Vectors
from ..sweeps.chains import prepared
from ..sweeps.momentum import gather_moment
from ..sweeps.wrenches import inertial_forces, virtual_power
from ..tails.mechanism import Segments

POWER = Argument("power", (1,), "lambda^T (H v_dot + C)")
A = Argument("a", (3,), "R^T (p_b_ddot + g z), which stands for v_dot[0:3]")
U_VIRTUAL = Argument("u", (3,), "R^T multiplier[0:3], the virtual velocity of B")
FIRST_MOMENT = Argument("moment", (3,), "first moment about B, torso axes (kg m)")


def assemble_core(draft: Draft, arrays: dict[str, Array]) -> None:
    """H v_dot + C with all vectors in torso axes: it depends on no attitude and no gravity; in air,
    v begins with the velocity of B against it.
    """
    state, force, v_dot = draft.state(arrays["q"], arrays["v"]), arrays["force"], arrays["v_dot"]
    u = core_airspeed(draft, state)
    segments = prepared(draft, state)
    motion = Motion(state.omega, draft.of_torso(v_dot, OMEGA), arrays["a"][0], u)
    inertial_forces(draft, segments, motion, v_dot, force)
    add_passive_forces(draft, state, lambda i: draft.tail.segment_v(force, i), v_dot)


def assemble_first_moment(draft: Draft, arrays: dict[str, Array]) -> None:
    """First moment of the animal."""
    moment = gather_moment(draft, prepared(draft, draft.state(arrays["q"])))
    draft.copy(arrays["moment"][0], moment["h"])


def assemble_virtual_power(draft: Draft, arrays: dict[str, Array]) -> list[Segments]:
    """lambda^T (H v_dot + C) in torso axes, as one sum over the links from the torso to the tip;
    returns the segments of each chain.
    """
    v_dot, multiplier = arrays["v_dot"], arrays["multiplier"]
    state = draft.state(arrays["q"], arrays["v"])
    segments = prepared(draft, state)

    # the torso moves by v and v_dot, and virtually by the multiplier
    motion = {"w": state.omega, "w_dot": block(v_dot, OMEGA), "a": arrays["a"][0]}
    virtual = {"w_virtual": block(multiplier, OMEGA), "u_virtual": arrays["u"][0]}
    if u := core_airspeed(draft, state):
        motion["u"] = u
    virtual_power(draft, segments, Vectors(motion | virtual), multiplier, v_dot, arrays["power"][0])
    add_passive_power(draft, state, multiplier, v_dot, arrays["power"][0])
    return segments


def assemble_world_power(draft: Draft, arrays: dict[str, Array]) -> None:
    """lambda^T (H v_dot + C), whose vectors are those of the arguments."""
    force = draft.array("force", draft.tail.nv)
    given = {name: arrays[name] for name in ("q", "v", "v_dot")}
    dynamics.assemble_inverse_dynamics(draft, given | {"force": force})
    draft.fill(arrays["power"][0], 0)
    with draft.loop("k", draft.tail.nv) as k:
        reads = {"weight": arrays["multiplier"].part(k, 1), "row": force.part(k, 1)}
        draft.step(airborne.product, reads, sum_=arrays["power"][0])


CORE = Function("core", "H v_dot + C in torso axes", (Q, V, V_DOT, A), (FORCE,), assemble_core)
MOMENT = Function(
    "first_moment", "first moment of the animal", (Q,), (FIRST_MOMENT,), assemble_first_moment
)
VIRTUAL_POWER = Function(
    "virtual_power",
    "lambda^T (H v_dot + C)",
    (Q, V, V_DOT, A, MULTIPLIER, U_VIRTUAL),
    (POWER,),
    assemble_virtual_power,
)
WORLD_POWER = Function(
    "world_power",
    "lambda^T (H v_dot + C)",
    (Q, V, V_DOT, MULTIPLIER),
    (POWER,),
    assemble_world_power,
)
# functions of one state without contact, of which derivatives are taken
FUNCTIONS = signed(dynamics.ASSEMBLIES | kinematics.ASSEMBLIES)

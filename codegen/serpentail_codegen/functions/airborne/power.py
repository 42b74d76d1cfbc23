"""The scalar function that is differentiated: virtual power, and momentum times a rigid motion.

Its weights are Lagrange's multipliers of the two sets of equations that determine accelerations and
omega: H v_dot + C = loads, and A_r v = R^T h.
"""

from serpentail_scene.layout import OMEGA
from serpentail_scene.signatures.arguments import MULTIPLIER, V_DOT, Argument, Q, V

from ...ir.program import Array
from ...mechanics import airborne_power, mount, torso
from ..derivatives.differentiated import POWER, U_VIRTUAL, A
from ..draft import Draft
from ..function import Function
from ..layout import block
from ..passive import add_passive_power
from ..scope import Vectors
from ..sweeps.pieces import across, each_piece, mechanism

DRIFT = Argument("drift", (3,), "velocity of B relative to the COM, torso axes")
RIGID = Argument("rigid", (3,), "turn of a virtual motion as one rigid body")
SLIDE = Argument("slide", (3,), "its velocity at B")


def assemble_power(draft: Draft, arrays: dict[str, Array]) -> None:
    """lambda^T (H v_dot + C), and the power of the momentum under a rigid motion, in one sweep
    outward.
    """
    v_dot, multiplier, power = arrays["v_dot"], arrays["multiplier"], arrays["power"][0]
    state = draft.state(arrays["q"], arrays["v"])
    segments = mechanism(draft).prepare(draft, state, False)

    # the torso
    motion = {"w": state.omega, "w_dot": block(v_dot, OMEGA), "a": arrays["a"][0]}
    virtual = {"w_virtual": block(multiplier, OMEGA), "u_virtual": arrays["u"][0]}
    rigid = {"w_rigid": arrays["rigid"][0], "u_rigid": arrays["slide"][0]}
    start = Vectors(motion | virtual | rigid | {"drift": arrays["drift"][0]})
    draft.step(torso.torso_power, start, power=power)
    draft.step(airborne_power.torso_momentum_power, start, power_=power)

    # from B to the tail mount
    names = ("w", "w_dot", "a", "w_virtual", "u_virtual", "u", "w_rigid", "u_rigid")
    carried = Vectors({name: draft.vector(f"{name}_here", 3) for name in names})
    draft.step(torso.mount_acceleration, start, a_mount=carried["a"])
    for w, u, target in (
        ("w_virtual", "u_virtual", "u_virtual"),
        ("w_rigid", "u_rigid", "u_rigid"),
        ("w", "drift", "u"),
    ):
        draft.step(torso.mount_velocity, {"w": start[w], "u": start[u]}, u=carried[target])
    for name in ("w", "w_dot", "w_virtual", "w_rigid"):
        draft.copy(carried[name], start[name])

    # into the tail's root axes
    across(draft, mount.motion_at_root, carried.only("w", "w_dot", "a").named)
    across(draft, mount.velocity_at_root, carried.only("u").named)
    for w, u in (("w_virtual", "u_virtual"), ("w_rigid", "u_rigid")):
        turned = {"w_virtual": carried[w], "u_virtual": carried[u]}
        across(draft, mount.virtual_velocity_at_root, turned)

    # from the mount to the tip
    for i, g in each_piece(draft):
        rates = segments.motion(i, v_dot), {"virtual_rates": draft.tail.segment_v(multiplier, i)}
        step = mechanism(draft).power_and_momentum
        draft.step(step, segments.at(i, g), *rates, carried, power_=power, **carried)
    add_passive_power(draft, state, multiplier, power)


POWER_AND_MOMENTUM = Function(
    "power_and_momentum",
    "lambda^T (H v_dot + C), and the momentum's power under a rigid motion",
    (Q, V, V_DOT, A, MULTIPLIER, U_VIRTUAL, DRIFT, RIGID, SLIDE),
    (POWER,),
    assemble_power,
)

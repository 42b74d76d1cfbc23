"""What holds in flight beside H v_dot + C = loads: the equations that give omega from a momentum.

They are programs, to be differentiated.
"""

from serpentail_scene.signatures.arguments import ANGULAR, Argument, Q, V

from ...ir.program import Array
from ...mechanics import airborne, rotations
from ..draft import Draft
from ..function import Function
from ..sweeps.momentum import gather_momentum
from ..sweeps.pieces import IDENTITY

MOMENTUM = Argument("momentum", (3,), "angular momentum about the centre of mass, torso axes")
AT_B = (
    Argument("linear", (3,), "momentum, torso axes"),
    Argument("angular", (3,), "angular momentum about B, torso axes"),
)
QUATERNION = Argument("quaternion", (4,), "w x y z of any norm")


def assemble_conserved(draft: Draft, arrays: dict[str, Array]) -> None:
    """R^T h."""
    reads = {"quaternion": arrays["quaternion"][0]}
    R = draft.store(rotations.quaternion_rotation, reads, R=9)
    reads = {"angular": arrays["angular"][0]}
    draft.step(airborne.momentum_in_torso, R, reads, momentum=arrays["momentum"][0])


def assemble_momentum(draft: Draft, arrays: dict[str, Array]) -> None:
    """Momenta at B, whose velocity is taken in torso axes."""
    state, identity = draft.state(arrays["q"], arrays["v"]), draft.fixed("identity", IDENTITY)
    momenta = gather_momentum(draft, state, identity, state.velocity)
    draft.copy(arrays["linear"][0], momenta["force"])
    draft.copy(arrays["angular"][0], momenta["moment"])


CONSERVED = Function(
    "conserved", "momentum in torso axes", (QUATERNION, ANGULAR), (MOMENTUM,), assemble_conserved
)
AT_BASE = Function("momentum_at_base", "momenta at B", (Q, V), AT_B, assemble_momentum)

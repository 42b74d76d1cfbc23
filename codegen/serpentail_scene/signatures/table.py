"""The table of all functions, and the lists of names that scenes are checked against.

The rules for scenes, the catalogue of assemblies, the manifest, the runtime's lists and the
documentation of functions follow from this table. Its order is that of the emitted code.
"""

from . import airborne, derivatives, gradients, simulation, values
from .signature import DERIVATIVE, PLANNING, VALUE

SIGNATURES = {
    signature.name: signature
    for signature in (
        *values.SIGNATURES,
        *derivatives.SIGNATURES,
        *simulation.SIGNATURES,
        *airborne.SIGNATURES,
        *gradients.SIGNATURES,
    )
}


def in_group(group: str) -> tuple[str, ...]:
    """Return the names of a group's functions."""
    return tuple(name for name, signature in SIGNATURES.items() if signature.group == group)


ALL = tuple(name for name, each in SIGNATURES.items() if not each.called)  # what a scene may name
VALUES = in_group(VALUE)
DERIVATIVES = in_group(DERIVATIVE)
AIRBORNE = in_group(PLANNING)
# of a tail on a fixed base
FIXED = (
    *("mass_matrix", "bias_force", "inverse_dynamics", "forward_dynamics"),
    *("energy", "momentum", "tail_points", "center_of_mass"),
    *("inverse_dynamics_derivatives", "forward_dynamics_derivatives"),
    *("inverse_dynamics_parameter_derivatives", "forward_dynamics_parameter_derivatives"),
    *("pfl", "implicit", "rollout", "loads", "mount_wrench", "tendon_lengths", "tendon_torques"),
)
# of several chains
OF_TREES = (
    *("mass_matrix", "bias_force", "inverse_dynamics", "forward_dynamics"),
    *("forward_dynamics_external", "energy", "momentum", "tail_points", "center_of_mass"),
    *("inverse_dynamics_derivatives", "forward_dynamics_derivatives", "energy_derivatives"),
    *("momentum_derivatives", "inverse_dynamics_vjp", "forward_dynamics_vjp"),
    *("inverse_dynamics_parameter_derivatives", "forward_dynamics_parameter_derivatives"),
    *("forward_dynamics_jvp", "pfl", "implicit", "rollout", "loads", "mount_wrench"),
    *("contact_points", "contact_dynamics", *AIRBORNE),
)
# of several chains of which some are prescribed
OF_GIVEN = tuple(name for name in OF_TREES if name not in (*DERIVATIVES, *AIRBORNE, "pfl"))
NEEDS = {name: signature.needs for name, signature in SIGNATURES.items() if signature.needs}
# functions from which first, then second derivatives of a compiled function are computed
EXACT_DERIVATIVES = {
    name: (signature.exact[0], signature.exact[1] + signature.exact[2])
    for name, signature in SIGNATURES.items()
    if signature.exact
}

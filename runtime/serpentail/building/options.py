"""What ``build`` accepts: the keys of a scene, and the parameters of the body."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any, TypedDict

from ..basics.checks import did_you_mean, shown
from ..basics.errors import ModelError
from ..model.state import Quantities, Quantity


class ParameterOptions(TypedDict, total=False):
    """Parameters by name, SI; by default the scene's values, else the paper's kangaroo rat.

    docs/theory.md describes them; not every tail has all of them.
    """

    gravity: Quantity
    gravity_vector: Quantities
    torso_mass: Quantity
    torso_inertia: Quantities
    tail_mount: Quantities
    mount_angles: Quantities
    tail_mass: Quantity
    tail_length: Quantity
    link_radius: Quantity
    link_inertia: Quantities
    link_masses: Quantities
    link_lengths: Quantities
    link_centers: Quantities
    link_inertias: Quantities
    joint_ratios: Quantities
    arc_masses: Quantities
    arc_lengths: Quantities
    K_n: Quantity
    D_n: Quantity
    K_f: Quantity
    D_f: Quantity
    mu: Quantity
    L_h2d: Quantity
    L_d2k: Quantity
    L_k2a: Quantity
    L_a2m: Quantity
    L_m2t: Quantity
    delta_m: Quantity
    hip: Quantities
    torso_semi_axes: Quantities
    tendon_offsets: Quantities
    tendon_limits: Quantities
    tendon_guides: Quantities
    tendon_ends: Quantities
    tendon_roots: Quantities
    air_density: Quantity
    wind: Quantities
    tail_widths: Quantities
    tail_drag: Quantities
    tail_drag_speed: Quantity
    torso_drag: Quantities
    torso_drag_turning: Quantities
    torso_air_damping: Quantities
    tail_stiffness: Quantities
    tail_rest: Quantities
    tail_damping: Quantities
    tail_stop_lower: Quantities
    tail_stop_upper: Quantities
    tail_stop_stiffness: Quantities
    tail_stop_width: Quantities
    tail_stop_damping: Quantities
    tail_rotor: Quantities
    motor_torque: Quantities
    motor_speed: Quantities
    motor_power: Quantities


IN_SCENES = {"tail": "kind", "tendons": "tendon"}  # what scenes call keys


class SceneKeys(TypedDict, total=False):
    """Keys of a scene that the generated code depends on; ``tail`` is the scene's key ``kind``."""

    tail: str
    segments: int | Sequence[Mapping[str, Any]]
    taper: Mapping[str, Any]
    body: Mapping[str, Any]
    links: int
    samples: int
    functions: Sequence[str] | str
    purpose: Sequence[str]
    contacts: Sequence[str]
    friction: str
    coordinates: str
    bend_range: Quantity
    real: str
    emission: str
    profile: str
    baked: bool
    base: str
    weightless: bool
    slope: Mapping[str, Any]
    targets: Sequence[str]
    chain: Mapping[str, Mapping[str, Any]]
    tendons: Mapping[str, Mapping[str, Any]]
    name: str


class Options(SceneKeys, ParameterOptions, total=False):
    """All keyword arguments of ``serpentail.build`` for scenes and bodies."""


def separated(
    options: Options, chains: Collection[str] = ()
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the keys of the scene, as scene files name them, and the parameters, among them those
    of chains with these names.

    ModelError names an option that is neither.
    """
    keys, parameters = {}, {}
    for name, value in options.items():
        if name in SceneKeys.__annotations__:
            keys[IN_SCENES.get(name, name)] = value
        elif name in ParameterOptions.__annotations__ or name.startswith(
            tuple(f"{chain}_" for chain in chains)
        ):
            parameters[name] = value
        else:
            raise _unknown(name, value)
    return keys, parameters


def _unknown(name: str, value: object) -> ModelError:
    """Return the error about a name that is neither a scene key nor a parameter."""
    known = Options.__annotations__
    name_of = {own: name for name, own in IN_SCENES.items()}.get(name, name)
    remedy = did_you_mean(name_of, known) or f"give some of {', '.join(known)}"
    return ModelError(
        f"{name}: value {shown(value)}: is neither a scene key nor a parameter; {remedy}"
    )

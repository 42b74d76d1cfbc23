"""What ``build`` accepts: the keys of a scene, and the parameters of the body."""

from collections.abc import Mapping, Sequence
from typing import Any, TypedDict

from ..basics.checks import did_you_mean, shown
from ..basics.errors import ModelError

Three = Sequence[float]
OneOrEach = float | Sequence[float]  # of all tail coordinates, or of each


class ParameterOptions(TypedDict, total=False):
    """Parameters by name, SI; by default the scene's values, else the paper's kangaroo rat.

    docs/theory.md describes them; not every tail has all of them.
    """

    gravity: float
    torso_mass: float
    torso_inertia: Three
    tail_mount: Three
    mount_angles: Three
    tail_mass: float
    tail_length: float
    link_radius: float
    link_inertia: Three
    link_masses: Sequence[float]
    link_lengths: Sequence[float]
    link_centers: Sequence[float]
    link_inertias: Sequence[Three]
    arc_masses: Sequence[float]
    arc_lengths: Sequence[float]
    K_n: float
    D_n: float
    K_f: float
    D_f: float
    mu: float
    L_h2d: float
    L_d2k: float
    L_k2a: float
    L_a2m: float
    L_m2t: float
    delta_m: float
    hip: Three
    torso_semi_axes: Three
    tail_stiffness: OneOrEach
    tail_rest: OneOrEach
    tail_damping: OneOrEach
    tail_stop_lower: OneOrEach
    tail_stop_upper: OneOrEach
    tail_stop_stiffness: OneOrEach
    tail_stop_width: OneOrEach


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
    bend_range: float
    real: str
    emission: str
    profile: str
    baked: bool
    base: str
    weightless: bool
    targets: Sequence[str]
    name: str


class Options(SceneKeys, ParameterOptions, total=False):
    """All keyword arguments of ``serpentail.build`` for scenes and bodies."""


def separated(options: Options) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the keys of the scene, as scene files name them, and the parameters.

    ModelError names an option that is neither.
    """
    keys, parameters = {}, {}
    for name, value in options.items():
        if name in SceneKeys.__annotations__:
            keys["kind" if name == "tail" else name] = value
        elif name in ParameterOptions.__annotations__:
            parameters[name] = value
        else:
            raise _unknown(name, value)
    return keys, parameters


def _unknown(name: str, value: object) -> ModelError:
    """Return the error about a name that is neither a scene key nor a parameter."""
    known = Options.__annotations__
    remedy = did_you_mean(name, known) or f"give some of {', '.join(known)}"
    return ModelError(
        f"{name}: value {shown(value)}: is neither a scene key nor a parameter; {remedy}"
    )

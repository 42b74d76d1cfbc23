"""Steps of links whose joints turn by unequal shares of their segment's angles.

``ratio`` is k: the joint turns by (k alpha, k beta).  So rates and accelerations of the coordinates
come in times k, and the joint's torques and columns count times k.
"""

from collections.abc import Callable
from dataclasses import is_dataclass, replace
from inspect import Parameter, Signature, signature
from typing import Any

from .air import link_drag_power
from .link import (
    gather_links,
    gather_wrench,
    joint_trigonometry,
    joint_twist,
    link_angular_velocity,
    link_motion,
    link_power,
)
from .shapes import V1

OF_COORDINATES = ("angles", "rates", "accelerations", "virtual_rates")
OF_JOINT = ("torque", "S")  # what steps return for each unit of the joint's own rates


def with_ratio(function: Callable[..., dict]) -> Callable[..., dict]:
    """Return the step of a link with one more vector, ``ratio``."""
    parameters = list(signature(function).parameters.values())
    reads = [p for p in parameters[1:] if p.default is p.empty]
    settings = {"ratio"} & {p.name for p in parameters}

    def step(let: Any, ratio: Any, *vectors: Any) -> dict:
        def scaled(name: str, vector: Any) -> Any:
            return let(f"own_{name}", ratio[0] * vector) if name in OF_COORDINATES else vector

        own = {}
        for p, vector in zip(reads, vectors, strict=True):
            group = (
                {n: scaled(n, x) for n, x in vars(vector).items()} if is_dataclass(vector) else {}
            )
            own[p.name] = replace(vector, **group) if group else scaled(p.name, vector)
        found = function(let, **own, **dict.fromkeys(settings, ratio[0]))
        return {n: ratio[0] * x if n in OF_JOINT else x for n, x in found.items()}

    first = Parameter("ratio", Parameter.POSITIONAL_OR_KEYWORD, annotation=V1)
    step.__signature__ = Signature([parameters[0], first, *reads])  # type: ignore[attr-defined]
    step.__name__, step.__doc__ = f"{function.__name__}_with_ratio", function.__doc__
    return step


WITH_RATIO = {
    function: with_ratio(function)
    for function in (
        *(joint_trigonometry, joint_twist, link_motion, link_angular_velocity, link_power),
        *(gather_links, gather_wrench, link_drag_power),
    )
}

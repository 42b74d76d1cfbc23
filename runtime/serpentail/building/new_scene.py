"""The text of a new scene file: commented, with values that are there to be changed."""

from collections.abc import Collection

from ..basics.checks import shown
from ..basics.errors import SerpentailError
from .scene_text import literal

LINKS, SAMPLES = 3, 5  # in each segment, unless something else is asked for

HEAD = """\
# What to model, and what to do with it. What is left out takes its default: docs/functions.md
# lists the functions, kangaroo_rat_m1_n3 (serpentail new --example) shows every key. Units are SI.
description = "A new scene"

kind = {kind}
segments = {segments:<10}  # m: each has two coordinates of its own
{pieces}
{contacts}
# The values that are commented out are those of a kangaroo rat.
[parameters]
# gravity = 9.8                                      # m/s^2
# torso_mass = 0.10572                               # kg
# torso_inertia = [6.722e-05, 3.639e-05, 7.279e-05]  # kg m^2, about B, its COM; x right, y forward
# tail_mount = [0.0, -0.0405, 0.0045]                # m, root of the tail from B
# tail_mass = 0.00351                                # kg, the whole tail
# tail_length = 0.19466                              # m, the whole tail
"""
LINKED = "links = {links:<13}  # n: rigid links in each segment"
SAMPLED = "samples = {samples:<11}  # points of the tail that are computed in each segment"
TOUCHING = """\
contacts = {groups}  # what can touch the ground z = 0
friction = "cone"
"""
GROUND = """\
# mu = 1.0                                           # friction
K_n = 300.0                                          # N/m^1.5, stiffness: soft, default 1000
D_n = 1.0                                            # s, damping; default 0.75
"""

FLIGHT = """
# A tumble in the air: `serpentail simulate FILE --view run.html`
[simulate]
duration = 0.4  # s

[simulate.start]
height = 0.5                # m, of B
velocity = [0.0, 0.5, 1.0]  # m/s, world: x right, y forward, z up
rate = [8.0, 0.0, 0.0]      # rad/s, torso axes
bends = {bends}  # rad, of each segment: about its own two axes

[simulate.controller]
kind = "damping"
damping = 1e-4  # N m s, of each joint coordinate
"""
DROP = """
# A drop onto the ground: `serpentail simulate FILE --view run.html`
[simulate]
duration = 0.6        # s
output_step = 0.001   # s

[simulate.start]
height = 0.06         # m, of B
pitch = 0.12          # rad, nose up

[simulate.controller]
kind = "damping"
damping = 1e-3        # N m s, of each joint coordinate
"""
LEGS = """
[simulate.legs]
gamma = 3.67          # rad, where thighs point: 0 forward, pi/2 up; 210 deg levels the soles
delta = -0.26         # rad, where shanks point: 0 forward, -pi/2 down, which stretches the legs
"""


def new_scene(
    tail: str, segments: int, links: int | None = None, contacts: Collection[str] = ()
) -> str:
    """Return the text of a scene file that can be simulated; SerpentailError for impossible sizes.

    tail: "articulated" or "continuum"; contacts: groups of points, as of a scene.
    """
    for name, size in (("segments", segments), ("links", links)):
        if size is not None and size < 1:
            raise SerpentailError(f"{name}: value {shown(size)}: needs a whole number, 1 or above")
    if tail == "continuum" and links is not None:
        raise SerpentailError(f"links: value {links}: a continuum tail has none: leave them out")
    groups = [name for name in ("feet", "tail", "torso") if name in contacts]
    head = HEAD.format(
        kind=literal("kind", tail),
        segments=segments,
        pieces=_pieces(tail, links),
        contacts=TOUCHING.format(groups=literal("contacts", groups)) if groups else "",
    )
    if not groups:
        return head + FLIGHT.format(bends=[[0.3, 0.2]] * segments)
    return head + GROUND + DROP + (LEGS if "feet" in groups else "")


def _pieces(tail: str, links: int | None) -> str:
    """Return the line about the links or samples of a segment."""
    if tail == "continuum":
        return SAMPLED.format(samples=SAMPLES)
    return LINKED.format(links=links or LINKS)

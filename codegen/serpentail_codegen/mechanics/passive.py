"""Springs, damping and stops of a tail's coordinates: the torques that they require, and energies.

Within a width w of a stop its stiffness grows from zero to its full value, as S(s) = 3 s^2 - 2 s^3
with s = depth / w. The force k w (s^3 - s^4 / 2) therefore has two continuous derivatives. Beyond,
it is that of a spring.
"""

from dataclasses import dataclass

from sympy import Matrix, Piecewise

from .shapes import V1, V2


def spring_force(let, tail_stiffness: V2, tail_rest: V2, angles: V2) -> dict:
    """k (q - rest)."""
    return {"passive": tail_stiffness.multiply_elementwise(angles - tail_rest)}


def damping_force(let, tail_damping: V2, rates: V2) -> dict:
    """d q_dot."""
    return {"passive": tail_damping.multiply_elementwise(rates)}


def rotor_torque(let, tail_rotor: V2, accelerations: V2) -> dict:
    """J q_ddot; J is that of a rotor times the gear ratio squared, its own momentum is left out."""
    return {"passive": tail_rotor.multiply_elementwise(accelerations)}


def rotor_inertia(let, tail_rotor: V1) -> dict:
    """J."""
    return {"inertia": tail_rotor}


def rotor_energy(let, tail_rotor: V2, rates: V2) -> dict:
    """J q_dot^2 / 2, of both coordinates."""
    return {"kinetic": [tail_rotor.dot(rates.multiply_elementwise(rates)) / 2]}


@dataclass(frozen=True)
class Stops:
    """The stops of both coordinates of a segment."""

    tail_stop_lower: V2
    tail_stop_upper: V2
    tail_stop_stiffness: V2
    tail_stop_width: V2


@dataclass(frozen=True)
class StopsOfCoordinate:
    """The stops of one coordinate."""

    tail_stop_lower: V1
    tail_stop_upper: V1
    tail_stop_stiffness: V1
    tail_stop_width: V1


def stop_force(let, stops: Stops, angles: V2) -> dict:
    """Force of the stops: negative below the lower one, positive above the upper one."""
    forces = []
    for k in range(len(angles)):
        stiffness, width = stops.tail_stop_stiffness[k], stops.tail_stop_width[k]
        under, over = ways_into(let, stops, k, angles[k])
        pushes = [s**3 - s**4 / 2 + beyond for s, beyond in (under, over)]
        forces.append(stiffness * width * let("push", pushes[1] - pushes[0]))
    return {"passive": Matrix(forces)}


def stop_damping_force(let, tail_stop_damping: V2, stops: Stops, angles: V2, rates: V2) -> dict:
    """d S q_dot: it grows with the stiffness S of the stops, and has none between them."""
    each = enumerate(angles)
    damping = [tail_stop_damping[k] * stiffness_into(let, stops, k, x) for k, x in each]
    return {"passive": Matrix(damping).multiply_elementwise(rates)}


def ways_into(let, stops: Stops | StopsOfCoordinate, k: int, angle) -> list[tuple]:
    """Depth of coordinate k in its lower and in its upper stop, in widths: the part up to one
    width, and the rest.
    """
    ways = []
    for way in (stops.tail_stop_lower[k] - angle, angle - stops.tail_stop_upper[k]):
        x = let("way", way / stops.tail_stop_width[k])
        beyond = let("beyond", Piecewise((x - 1, x > 1), (0, True)))
        ways.append((let("within", Piecewise((x - beyond, x > 0), (0, True))), beyond))
    return ways


def stiffness_into(let, stops: Stops | StopsOfCoordinate, k: int, angle):
    """Stiffness of both stops of coordinate k, over that beyond their width."""
    return sum(s * s * (3 - 2 * s) for s, _ in ways_into(let, stops, k, angle))


def spring_energy(let, tail_stiffness: V2, tail_rest: V2, angles: V2) -> dict:
    """k (q - rest)^2 / 2, of both coordinates."""
    stretch = let("stretch", angles - tail_rest)
    squares = stretch.multiply_elementwise(stretch)
    return {"potential": [tail_stiffness.dot(squares) / 2]}


def stop_energy(let, stops: Stops, angles: V2) -> dict:
    """The integral of the stops' forces over the depth."""
    total = 0
    for k in range(len(angles)):
        ways = ways_into(let, stops, k, angles[k])
        parts = sum(s**4 / 4 - s**5 / 10 + beyond * (beyond + 1) / 2 for s, beyond in ways)
        total += stops.tail_stop_stiffness[k] * stops.tail_stop_width[k] ** 2 * let("part", parts)
    return {"potential": [total]}


def net_torque(let, tau: V2, passive: V2) -> dict:
    """Torques that are left to accelerate the tail."""
    return {"net": tau - passive}


def virtual_power(let, passive: V2, virtual_rates: V2) -> dict:
    """Power of the passive parts at virtual rates."""
    return {"power": [passive.dot(virtual_rates)]}


# ---- linearised, for implicit integrators --------------------------------------------------------


def spring_slope(let, tail_stiffness: V1) -> dict:
    """k."""
    return {"slope": tail_stiffness}


def stop_slope(let, stops: StopsOfCoordinate, angle: V1) -> dict:
    """Stiffness of the stops at a coordinate."""
    return {"slope": [stops.tail_stop_stiffness[0] * stiffness_into(let, stops, 0, angle[0])]}


def damped_coordinate(let, tail_damping: V1, weight: V1, gain_v: V1) -> dict:
    """w times the tail's own damping, which tracking cancels."""
    return {"damped": [untracked(gain_v, weight[0] * tail_damping[0])]}


def damped_in_stops(
    let, tail_stop_damping: V1, stops: StopsOfCoordinate, angle: V1, weight: V1, gain_v: V1
) -> dict:
    """w times the damping of the stops."""
    damping = tail_stop_damping[0] * stiffness_into(let, stops, 0, angle[0])
    return {"damped": [untracked(gain_v, weight[0] * damping)]}


def sprung_coordinate(let, weight: V1, gain_v: V1, slope: V1) -> dict:
    """w times the stiffness, and w^2 times the stiffness, which acts like damping."""
    sprung = let("sprung", untracked(gain_v, weight[0] * slope[0]))
    return {"sprung": [sprung], "damped": [weight[0] * sprung]}


def untracked(gain_v, value):
    """A value, or 0 if tracking cancels all forces of the tail."""
    return Piecewise((0, gain_v[0] > 0), (value, True))


def sprung_response(let, sprung: V1, angle: V1) -> dict:
    """Force of a stiffness for the right-hand side of a coordinate."""
    return {"rhs": [-sprung[0] * angle[0]]}

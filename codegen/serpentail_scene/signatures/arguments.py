"""The arguments of functions: their names, shapes and meanings.

A shape consists of numbers and names of sizes, such as ("nv", "nv"). `functions.tail.Tail` has a
property for each name.
"""

from dataclasses import dataclass
from math import prod


@dataclass(frozen=True)
class Argument:
    """One array argument of a function: its shape, and its meaning with unit and frame."""

    name: str
    sizes: tuple[int | str, ...]
    meaning: str

    def shape(self, tail: object) -> tuple[int, ...]:
        """Return the shape that it has for a tail."""
        return tuple(n if isinstance(n, int) else int(getattr(tail, n)) for n in self.sizes)

    def length(self, tail: object) -> int:
        """Return how many numbers it has for a tail."""
        return prod(self.shape(tail))


def nv_numbers(name: str, meaning: str) -> Argument:
    """Return a vector argument (nv,)."""
    return Argument(name, ("nv",), meaning)


def nv_by_nv(name: str, meaning: str) -> Argument:
    """Return a matrix argument (nv, nv)."""
    return Argument(name, ("nv", "nv"), meaning)


def three_by_nv(name: str, meaning: str) -> Argument:
    """Return a matrix argument (3, nv)."""
    return Argument(name, (3, "nv"), meaning)


def bristle_numbers(name: str, meaning: str) -> Argument:
    """Return a vector argument with two numbers for each point that can touch the ground."""
    return Argument(name, ("bristles",), meaning)


# fmt: off
# States, accelerations and forces
Q = Argument("q", ("nq",),
    "configuration: position of B (m, world), quaternion w x y z, tail coordinates (rad)")
V = nv_numbers("v",
    "velocity of B (m/s, world), omega (rad/s, body), rates of the tail coordinates (rad/s)")
V_DOT = nv_numbers("v_dot", "acceleration: time derivative of v (m/s^2, rad/s^2)")
TAU = Argument("tau", ("nt",), "torques conjugate to the tail coordinates (N m)")
F_EXT = Argument("f_ext", ("loads",),
    "force at B (N, world), moment (N m, body), then a force (N, world) at each of the N + 1 tail "
    "points")
PUSH = Argument("push", ("pushes",),
    "force on the torso (N, world), sum of places (torso axes) times forces (N m), then a force "
    "(N, world) at each tail point, then at A, M, T of both feet")
FORCE = nv_numbers("force",
    "generalised force: at B (N, world), moment (N m, body), torques of the tail coordinates (N m)")
ACCELERATIONS = Argument("accelerations", ("nt",),
    "desired accelerations of the tail coordinates (rad/s^2)")
MULTIPLIER = nv_numbers("multiplier", "weights lambda, one for each row of the force or of v_dot")

# Prescribed joints: of functions of q, and their own torques among what inverse dynamics gives
GIVEN = Argument("given", (3, "given"),
    "angles of the prescribed coordinates (rad), then their rates (rad/s), then accelerations "
    "(rad/s^2)")
GIVEN_TORQUES = Argument("given_torques", ("given",),
    "torques of the drives of the prescribed coordinates (N m)")

TENSIONS = Argument("tension", ("tendons",), "tensions of the tendons (N)")

# What plain functions return
H = nv_by_nv("H", "inertia matrix, symmetric and positive definite (kg, kg m, kg m^2)")
POINTS = Argument("points", ("tail_points", 3),
    "positions of the joints, then of the tip (m, world)")
JACOBIANS = Argument("J", ("tail_points", 3, "nv"),
    "Jacobians of the tail points: velocity of a point (m/s, world) = J v")
KINETIC = Argument("kinetic", (1,), "kinetic energy (J)")
POTENTIAL = Argument("potential", (1,),
    "potential energy, zero at the height of the world's origin (J)")
LINEAR = Argument("linear", (3,), "linear momentum (kg m/s, world)")
ANGULAR = Argument("angular", (3,), "angular momentum about the centre of mass (kg m^2/s, world)")

# Derivatives
DPARAMETERS = Argument("dparameters", ("nv", "parameter_numbers"),
    "derivative with respect to the values of the parameter struct, in their order")

# Contact
LEGS = Argument("legs", ("leg_numbers",),
    "leg angles gamma_1, delta_1 (right), gamma_2, delta_2 (left) (rad), then their rates (rad/s)")
ANGLES = Argument("angles", (4,),
    "leg angles gamma_1, delta_1 (right), gamma_2, delta_2 (left) (rad)")
JOINTS = Argument("joints", (2, 6, 3),
    "positions of hip, D, knee, A, M and T of the right leg, then of the left (m, world)")
POSITIONS = Argument("positions", ("points", 3),
    "positions of the points that can touch the ground (m, world)")
VELOCITIES = Argument("velocities", ("points", 3), "their velocities (m/s, world)")
BRISTLES = bristle_numbers("bristles", "deflections of the friction bristles (m, world x and y)")
BRISTLE_RATES = bristle_numbers("bristle_rates", "rates of the bristle deflections (m/s)")
FORCES = Argument("forces", ("points", 3), "forces of the ground on the points (N, world)")
HEIGHTS = Argument("heights", ("points", 2),
    "heights of the points above the ground (m), and their rates (m/s)")
POWERS = Argument("powers", (2,),
    "powers of the ground on the points, and of the leg actuators (W)")

# Linear systems of implicit methods
DAMPING = Argument("damping", ("nt",),
    "damping of the tail coordinates (N m s): tau = -damping q_t_dot")
GAINS = Argument("gains", (2,),
    "tracking gains K_p (1/s^2), K_d (1/s), applied through H_tt; zeros if nothing is tracked")
WEIGHT = Argument("weight", ("weights",),
    "weight w of J: the method's coefficient times the step (s); with contacts a second number: 1, "
    "or 0 to keep the bound of friction fixed")
FACTORS = Argument("factors", ("factors",), "factors and intermediate results for implicit_solve")

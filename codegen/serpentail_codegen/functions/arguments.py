"""The functions a scene can ask for: a tail's sizes go in, the loop nest of each function comes
out.
"""

from .function import Argument

Q = Argument(
    "q",
    lambda t: (t.nq,),
    "configuration: position of B (m, world), quaternion w x y z, tail coordinates (rad)",
)
V = Argument(
    "v",
    lambda t: (t.nv,),
    "velocity: of B (m/s, world), omega (rad/s, body), rates of the tail coordinates (rad/s)",
)
V_DOT = Argument("v_dot", lambda t: (t.nv,), "time derivative of v")
TAU = Argument("tau", lambda t: (t.nt,), "torques (N m), conjugate to the tail coordinates")
F_EXT = Argument(
    "f_ext",
    lambda t: (6 + 3 * (t.total + 1),),
    "force at B (N, world), moment (N m, body), then a force (N, world) at each of the N + 1 tail "
    "points",
)
GENERALISED = (
    "generalised force: on p_dot (N, world), on omega (N m, body), on the rates of the tail "
    "coordinates (N m)"
)
FORCE = Argument("force", lambda t: (t.nv,), GENERALISED)
H = Argument(
    "H", lambda t: (t.nv, t.nv), "inertia matrix, symmetric positive definite (kg, kg m, kg m^2)"
)
POINTS = Argument("points", lambda t: (t.total + 1, 3), "joint positions, then the tip (m, world)")
JACOBIANS = Argument("J", lambda t: (t.total + 1, 3, t.nv), "d(point)/dt = J v")
KINETIC = Argument("kinetic", lambda t: (1,), "kinetic energy (J)")
POTENTIAL = Argument(
    "potential", lambda t: (1,), "potential energy, zero at the height of the world's origin (J)"
)
LINEAR = Argument("linear", lambda t: (3,), "momentum (kg m/s, world)")
ANGULAR = Argument(
    "angular", lambda t: (3,), "angular momentum about the centre of mass (kg m^2/s, world)"
)

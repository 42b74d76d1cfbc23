"""An animal in exact rational arithmetic: SymPy differentiates the rotations of its joints.

Products carry derivatives by Leibniz' rule; sines and cosines are rational points of the circle, so
nothing is rounded and equality is equality.
"""

import random
from functools import cache
from types import SimpleNamespace

import sympy
from sympy import Matrix, Rational, diag, eye, zeros
from sympy.algebras.quaternion import Quaternion

from serpentail_codegen.functions.derivatives.differentiated import FUNCTIONS
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.interpret import Numbers, Run

X, Y, Z = (eye(3).col(k) for k in range(3))
# an angle is given by the tangent of its half
CIRCLE = SimpleNamespace(
    sin=lambda x: 2 * x / (1 + x * x), cos=lambda x: (1 - x * x) / (1 + x * x), sqrt=None
)
EXACT = Numbers(CIRCLE, Rational)


def skew(w):
    """The matrix of w x."""
    return Matrix([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def vee(S):
    """The vector of a skew-symmetric matrix."""
    assert S == -S.T
    return Matrix([S[2, 1], S[0, 2], S[1, 0]])


def rotation(axis, angle):
    """Rodrigues' formula."""
    c, s = sympy.cos(angle), sympy.sin(angle)
    return c * eye(3) + s * skew(axis) + (1 - c) * axis * axis.T


@cache
def joint_symbols():
    """R_x(alpha(t)) R_z(beta(t)) and two derivatives, by SymPy, with alpha and beta."""
    t = sympy.Symbol("t")
    angles = [sympy.Function(name)(t) for name in ("alpha", "beta")]
    turn = rotation(X, angles[0]) * rotation(Z, angles[1])
    return t, angles, [turn, turn.diff(t), turn.diff(t, 2)]


def joint_turn(halves, rates, accelerations):
    """The turn of one universal joint and two time derivatives, at numbers."""
    t, angles, turns = joint_symbols()
    numbers = {}
    for angle, x, rate, acceleration in zip(angles, halves, rates, accelerations, strict=True):
        numbers |= {sympy.cos(angle): CIRCLE.cos(x), sympy.sin(angle): CIRCLE.sin(x)}
        numbers |= {angle.diff(t): rate, angle.diff(t, 2): acceleration}
    return [turn.xreplace(numbers) for turn in turns]


def product(A, B):
    """Leibniz' rule for two matrices and two derivatives of each."""
    return [A[0] * B[0], A[1] * B[0] + A[0] * B[1], A[2] * B[0] + 2 * A[1] * B[1] + A[0] * B[2]]


def moved(point, scale, R, vector):
    """point + scale R vector, with derivatives."""
    return [p + scale * r * vector for p, r in zip(point, R, strict=True)]


class Body(SimpleNamespace):
    """A rigid body: mass, principal inertia about the COM, and jets of R, its joint and its COM."""

    @property
    def omega(self):
        """Angular velocity in its own axes: R^T R_dot = skew(omega)."""
        return vee(self.R[0].T * self.R[1])

    @property
    def spin(self):
        """Angular momentum about the COM, world axes."""
        return self.R[0] * self.inertia * self.omega

    @property
    def spin_rate(self):
        """Time derivative of spin."""
        omega_dot = vee(self.R[0].T * self.R[2] + self.R[1].T * self.R[1])
        return self.R[1] * self.inertia * self.omega + self.R[0] * self.inertia * omega_dot


class State(SimpleNamespace):
    """Random rational parameters, configuration, velocity and acceleration of a tail."""

    def __init__(self, m, n, seed):
        rng = random.Random(seed)

        def numbers(size, low=-9):
            return Matrix([Rational(rng.randint(low, 9), rng.randint(1, 7)) for _ in range(size)])

        names = ("gravity", "torso_mass", "tail_mass", "tail_length")
        parameters = {name: numbers(1, 1) for name in names}
        parameters |= {name: numbers(3, 1) for name in ("torso_inertia", "link_inertia")}
        parameters["tail_mount"], tail = numbers(3), Tail(m, n)
        super().__init__(tail=tail, parameters=parameters, p=numbers(3), quaternion=numbers(4, 1))
        self.halves, self.tau = numbers(2 * m), numbers(2 * m)
        self.f_ext = numbers(6 + 3 * (tail.total + 1))
        self.v, self.v_dot = numbers(tail.nv), numbers(tail.nv)
        self.mass, self.length = (
            parameters[name][0] / tail.total for name in ("tail_mass", "tail_length")
        )

    @property
    def arguments(self):
        """Values of every parameter and argument that a program may have."""
        q = [*self.p, *self.quaternion, *self.halves]
        own = {"q": q, "v": self.v, "v_dot": self.v_dot, "tau": self.tau, "f_ext": self.f_ext}
        return {name: list(values) for name, values in (self.parameters | own).items()}

    def bodies(self, v=None, v_dot=None):
        """Torso and links, moving at v and v_dot (Eqs. 11 to 15 and their derivatives)."""
        v, v_dot = (zeros(self.tail.nv, 1) if x is None else x for x in (v, v_dot))
        R, spin = Quaternion(*self.quaternion).to_rotation_matrix(), skew(v[3:6, :])
        R = [R, R * spin, R * (spin * spin + skew(v_dot[3:6, :]))]
        p = [self.p, v[0:3, :], v_dot[0:3, :]]
        mount = moved(p, 1, R, self.parameters["tail_mount"])
        torso, link = (diag(*self.parameters[f"{of}_inertia"]) for of in ("torso", "link"))
        mass = self.parameters["torso_mass"][0]
        found = [Body(mass=mass, inertia=torso, R=R, joint=p, com=p, end=mount)]
        for g in range(self.tail.total):
            i, parent = g // self.tail.links, found[-1]
            own = slice(6 + 2 * i, 8 + 2 * i)
            turn = joint_turn(self.halves[2 * i : 2 * i + 2], v[own, :], v_dot[own, :])
            R = product(parent.R, turn)
            com, end = (
                moved(parent.end, -part * self.length, R, Y) for part in (Rational(1, 2), 1)
            )
            found.append(
                Body(mass=self.mass, inertia=link, R=R, joint=parent.end, com=com, end=end)
            )
        return found

    def columns(self):
        """The bodies moving with each coordinate's rate alone at one."""
        return [self.bodies(v=eye(self.tail.nv).col(k)) for k in range(self.tail.nv)]

    def mass_matrix(self):
        """H from twice the kinetic energy as a quadratic form."""
        nv, columns = self.tail.nv, self.columns()
        return Matrix(nv, nv, lambda k, other: kinetic_form(columns[k], columns[other]))

    def force(self, v_dot):
        """H v_dot + C by virtual work (d'Alembert)."""
        bodies, lift = self.bodies(self.v, v_dot), self.parameters["gravity"][0] * Z

        def work(column):
            pairs = zip(bodies, column, strict=True)
            return sum(
                b.mass * (b.com[2] + lift).dot(c.com[1]) + b.spin_rate.dot(c.R[0] * c.omega)
                for b, c in pairs
            )

        return Matrix([work(column) for column in self.columns()])

    def point_jacobian(self):
        """d(tail points)/dt = J v, a row for each of x, y, z of each point."""
        return Matrix.hstack(
            *(Matrix.vstack(*(body.end[1] for body in column)) for column in self.columns())
        )


def kinetic_form(some, others):
    """Sum of m v . v' + omega . I omega'."""
    return sum(
        a.mass * a.com[1].dot(b.com[1]) + a.omega.dot(b.inertia * b.omega)
        for a, b in zip(some, others, strict=True)
    )


def run(name, state):
    """Run a function's program on exact numbers; return its outputs as columns."""
    p = assemble(FUNCTIONS[name], state.tail)
    names = [array.name for array in (*p.of_role("parameters"), *p.of_role("input"))]
    found = Run(p, EXACT, {name: state.arguments[name] for name in names}).values
    return {array.name: Matrix(found[array.name]) for array in p.of_role("output")}


def momentum_about(origin, bodies):
    """Momentum of bodies and its moment about a point, world axes."""
    moment = zeros(3, 1)
    for body in bodies:
        moment += body.spin + (body.com[0] - origin).cross(body.mass * body.com[1])
    return Matrix.vstack(sum((b.mass * b.com[1] for b in bodies), zeros(3, 1)), moment)

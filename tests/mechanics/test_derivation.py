"""The derivation: every step and every function equals its definition, exactly, in rational
arithmetic.

SymPy differentiates the joint turns; products carry derivatives by Leibniz' rule; sines and cosines
are rational points of the circle, so nothing is rounded and equality is equality.
"""

import math
import random
from collections import Counter
from functools import cache
from itertools import pairwise
from types import SimpleNamespace

import pytest
import sympy
from sympy import Matrix, Rational, diag, eye, zeros
from sympy.algebras.quaternion import Quaternion

from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.plain import FUNCTIONS
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.interpret import Numbers, Run, unroll
from serpentail_codegen.ir.program import Apply, statements
from serpentail_codegen.ir.tape import operation_count, replay
from serpentail_codegen.mechanics import link, rotations, torso
from serpentail_codegen.mechanics.lower import Recorder, derive

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
    return (
        sympy.cos(angle) * eye(3)
        + sympy.sin(angle) * skew(axis)
        + (1 - sympy.cos(angle)) * axis * axis.T
    )


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
    """A rigid body in motion: mass, principal inertia about the COM, and jets of R, its joint and
    its COM.
    """

    @property
    def omega(self):
        """Angular velocity in its own axes: R^T R_dot = skew(omega)."""
        return vee(self.R[0].T * self.R[1])

    @property
    def omega_dot(self):
        """Time derivative of omega."""
        return vee(self.R[0].T * self.R[2] + self.R[1].T * self.R[1])

    @property
    def spin(self):
        """Angular momentum about the COM, world axes."""
        return self.R[0] * self.inertia * self.omega

    @property
    def spin_rate(self):
        """Time derivative of spin."""
        return self.R[1] * self.inertia * self.omega + self.R[0] * self.inertia * self.omega_dot


class State(SimpleNamespace):
    """Random rational parameters, configuration, velocity and acceleration of a tail."""

    def __init__(self, m, n, seed):
        rng = random.Random(seed)

        def numbers(size, low=-9):
            return Matrix([Rational(rng.randint(low, 9), rng.randint(1, 7)) for _ in range(size)])

        names = ("gravity", "torso_mass", "tail_mass", "tail_length")
        parameters = {name: numbers(1, 1) for name in names}
        parameters |= {
            "torso_inertia": numbers(3, 1),
            "tail_mount": numbers(3),
            "link_inertia": numbers(3, 1),
        }
        tail = Tail(m, n)
        super().__init__(tail=tail, parameters=parameters, p=numbers(3), quaternion=numbers(4, 1))
        self.halves, self.tau, self.f_ext = (
            numbers(2 * m),
            numbers(2 * m),
            numbers(6 + 3 * (tail.total + 1)),
        )
        self.v, self.v_dot = numbers(tail.nv), numbers(tail.nv)
        self.mass, self.length = (
            parameters["tail_mass"][0] / tail.total,
            parameters["tail_length"][0] / tail.total,
        )

    @property
    def arguments(self):
        """Values of every parameter and argument that a program may have."""
        q = [*self.p, *self.quaternion, *self.halves]
        own = {"q": q, "v": self.v, "v_dot": self.v_dot, "tau": self.tau, "f_ext": self.f_ext}
        return {name: list(values) for name, values in (self.parameters | own).items()}

    def link(self):
        """The vector that steps know as ``link``, by the parallel axis theorem."""
        m, L = self.mass, self.length
        steiner = m * (L / 2) ** 2
        return Matrix([m, L, m * L / 2]).col_join(
            self.parameters["link_inertia"] + steiner * Matrix([1, 0, 1])
        )

    def joint(self, segment):
        """The vector that steps know as ``joint``."""
        return Matrix(
            [
                f(x)
                for x in self.halves[2 * segment : 2 * segment + 2]
                for f in (CIRCLE.cos, CIRCLE.sin)
            ]
        )

    def tail_vector(self, v, segment):
        """The two entries of a velocity or acceleration that belong to a segment."""
        return v[6 + 2 * segment : 8 + 2 * segment, :]

    def bodies(self, v=None, v_dot=None):
        """Torso and links, moving at v and v_dot (Eqs. 11 to 15 and their derivatives)."""
        v, v_dot = (zeros(self.tail.nv, 1) if x is None else x for x in (v, v_dot))
        R, spin = Quaternion(*self.quaternion).to_rotation_matrix(), skew(v[3:6, :])
        R = [R, R * spin, R * (spin * spin + skew(v_dot[3:6, :]))]
        p = [self.p, v[0:3, :], v_dot[0:3, :]]
        mount = moved(p, 1, R, self.parameters["tail_mount"])
        inertia = diag(*self.parameters["torso_inertia"])
        found = [
            Body(
                mass=self.parameters["torso_mass"][0],
                inertia=inertia,
                R=R,
                joint=p,
                com=p,
                end=mount,
            )
        ]
        for g in range(self.tail.total):
            i, parent = g // self.tail.links, found[-1]
            halves = self.halves[2 * i : 2 * i + 2]
            R = product(
                parent.R, joint_turn(halves, self.tail_vector(v, i), self.tail_vector(v_dot, i))
            )
            com, end = (
                moved(parent.end, -part * self.length, R, Y) for part in (Rational(1, 2), 1)
            )
            inertia = diag(*self.parameters["link_inertia"])
            found.append(
                Body(mass=self.mass, inertia=inertia, R=R, joint=parent.end, com=com, end=end)
            )
        return found

    def columns(self):
        """The bodies moving with each coordinate's rate alone at one."""
        return [self.bodies(v=eye(self.tail.nv).col(k)) for k in range(self.tail.nv)]

    def mass_matrix(self):
        """H from twice the kinetic energy as a quadratic form."""
        columns = self.columns()
        return Matrix(
            self.tail.nv, self.tail.nv, lambda k, other: kinetic_form(columns[k], columns[other])
        )

    def force(self, v_dot):
        """H v_dot + C by virtual work (d'Alembert)."""
        bodies, lift = self.bodies(self.v, v_dot), self.parameters["gravity"][0] * Z
        return Matrix(
            [
                sum(
                    b.mass * (b.com[2] + lift).dot(c.com[1]) + b.spin_rate.dot(c.R[0] * c.omega)
                    for b, c in zip(bodies, column, strict=True)
                )
                for column in self.columns()
            ]
        )

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


def call(function, **vectors):
    """Replay a derived step on exact numbers; return its outputs as columns."""
    step = derive(function)
    values = replay(
        step.nodes, [scalar for name, _ in step.inputs for scalar in vectors[name]], EXACT
    )
    results = iter([values[node] for node in step.results])
    return {name: Matrix([next(results) for _ in range(size)]) for name, size in step.outputs}


def run(name, state):
    """Run a function's program on exact numbers; return its outputs as columns."""
    p = assemble(FUNCTIONS[name], state.tail)
    names = {array.name for array in (*p.of_role("parameters"), *p.of_role("input"))}
    found = Run(
        p, EXACT, {name: values for name, values in state.arguments.items() if name in names}
    ).values
    return {array.name: Matrix(found[array.name]) for array in p.of_role("output")}


@pytest.fixture(params=[(1, 3), (2, 2), (3, 1)], ids=["m1_n3", "m2_n2", "m3_n1"])
def state(request):
    """A random rational state of a tail."""
    return State(*request.param, seed=7)


@pytest.fixture
def links(state):
    """Every link with its parent and its segment, at v and v_dot."""
    bodies = state.bodies(state.v, state.v_dot)
    return [
        (parent, body, g // state.tail.links) for g, (parent, body) in enumerate(pairwise(bodies))
    ]


# Kinematics, step by step.


def test_rotation_of_a_quaternion_that_need_not_be_normalised(state):
    R = call(rotations.quaternion_rotation, quaternion=state.quaternion)["R"]
    assert call(rotations.quaternion_rotation, quaternion=-3 * state.quaternion)["R"] == R
    assert Matrix(3, 3, list(R)) == Quaternion(*state.quaternion).to_rotation_matrix()


def test_trigonometry_of_a_joint(state):
    joint = call(link.joint_trigonometry, angles=state.halves[:2])["joint"]
    assert joint == state.joint(0)
    twice = call(link.double_angles, joint=joint)["twice"]
    angle = sympy.Symbol("angle", real=True)
    for k, (c, s) in enumerate((joint[:2], joint[2:])):
        sine, cosine, double = sympy.sin(angle), sympy.cos(angle), 2 * angle
        expected = [sine**2, sympy.sin(double) / 2, sympy.sin(double), sympy.cos(double), cosine**2]
        numbers = {sympy.cos(angle): c, sympy.sin(angle): s}
        assert twice[5 * k : 5 * k + 5, :] == Matrix(
            [sympy.expand_trig(e).xreplace(numbers) for e in expected]
        )


def test_angular_velocity_is_that_of_the_rotation(state, links):
    for parent, body, i in links:
        rates = state.tail_vector(state.v, i)
        assert (
            call(link.link_angular_velocity, joint=state.joint(i), rates=rates, w=parent.omega)["w"]
            == body.omega
        )


def test_link_motion_is_the_second_derivative_of_the_pose(state, links):
    for parent, body, i in links:
        rates, accelerations = (state.tail_vector(v, i) for v in (state.v, state.v_dot))
        here = {"w": parent.omega, "w_dot": parent.omega_dot, "a": parent.R[0].T * parent.end[2]}
        known = {
            "joint": state.joint(i),
            "rates": rates,
            "accelerations": accelerations,
            "link": state.link(),
        }
        motion = call(link.link_motion, **known, **here)
        assert (motion["w"], motion["w_dot"]) == (body.omega, body.omega_dot)
        assert motion["a_joint"] == body.R[0].T * body.joint[2]
        assert motion["a"] == body.R[0].T * body.end[2]
        assert motion["a_joint"] - state.length / 2 * motion["swing"] == body.R[0].T * body.com[2]


def test_link_velocity_is_the_derivative_of_the_pose(state, links):
    for parent, body, i in links:
        u = parent.R[0].T * parent.end[1]
        found = call(
            link.link_linear_velocity, joint=state.joint(i), link=state.link(), w=body.omega, u=u
        )
        assert (found["u_joint"], found["u"]) == (
            body.R[0].T * body.joint[1],
            body.R[0].T * body.end[1],
        )


def test_mount_moves_with_the_torso(state, links):
    body, r = links[0][0], state.parameters["tail_mount"]
    R, mount = body.R[0], body.end
    u = call(torso.torso_velocity, R=R, p_dot=state.v[:3])["u"]
    assert call(torso.mount_velocity, u=u, w=body.omega, tail_mount=r)["u"] == R.T * mount[1]
    a = call(torso.torso_acceleration, R=R, p_ddot=state.v_dot[:3], gravity=[0])["a"]
    at_mount = call(
        torso.mount_acceleration, w=body.omega, w_dot=body.omega_dot, a=a, tail_mount=r
    )["a_mount"]
    assert at_mount == R.T * mount[2]
    assert call(torso.mount_position, R=R, p=state.p, tail_mount=r)["P"] == mount[0]


# Dynamics, step by step.


def test_link_properties_are_those_of_one_of_equal_links(state):
    names = ("tail_mass", "tail_length", "link_inertia")
    known = {name: state.parameters[name] for name in names}
    assert (
        call(link.link_properties, share=[Rational(1, state.tail.total)], **known)["link"]
        == state.link()
    )


def wrench_about(point, body):
    """Inertial force of a body and its moment about a point, world axes, by Newton and Euler."""
    force = body.mass * body.com[2]
    return Matrix.vstack(force, body.spin_rate + (body.com[0] - point).cross(force))


def in_frame(R, wrench):
    """Force and moment in the axes of R."""
    return Matrix.vstack(R.T * wrench[:3, :], R.T * wrench[3:, :])


def test_link_wrench_is_newton_and_euler_about_the_joint(state, links):
    for _, body, _ in links:
        R = body.R[0]
        a_joint, a_com = R.T * body.joint[2], R.T * body.com[2]
        swing = (a_joint - a_com) * 2 / state.length
        found = call(
            link.link_wrench,
            link=state.link(),
            w=body.omega,
            w_dot=body.omega_dot,
            a_joint=a_joint,
            swing=swing,
        )
        assert found["F"] == in_frame(R, wrench_about(body.joint[0], body))


def test_gathered_wrench_is_the_sum_over_all_links_beyond(state, links):
    beyond = zeros(6, 1)
    for k in reversed(range(len(links))):
        parent, body, i = links[k]
        own = in_frame(body.R[0], wrench_about(body.joint[0], body))
        found = call(
            link.gather_wrench, joint=state.joint(i), link=state.link(), F=own, F_next=beyond
        )
        total = sum((wrench_about(body.joint[0], other) for _, other, _ in links[k:]), zeros(6, 1))
        beyond = found["F_next"]
        assert beyond == in_frame(parent.R[0], total)
        assert list(found["torque"]) == [
            total[3:, :].dot(parent.R[0].col(0)),
            total[3:, :].dot(body.R[0].col(2)),
        ]


def test_link_momentum_and_kinetic_energy_are_their_definitions(state, links):
    for _, body, _ in links:
        R, momentum = body.R[0], body.mass * body.com[1]
        found = call(
            link.link_momentum, link=state.link(), w=body.omega, u_joint=R.T * body.joint[1]
        )
        about_joint = body.spin + (body.com[0] - body.joint[0]).cross(momentum)
        assert found["F"] == in_frame(R, Matrix.vstack(momentum, about_joint))
        assert found["kinetic"][0] == kinetic_form([body], [body]) / 2


@pytest.mark.parametrize(("axes", "axis", "part"), [((0, 1, 2), Z, 1), ((1, 2, 0), X, 0)])
def test_double_angles_turn_an_inertia(state, axes, axis, part):
    joint, inertia = state.joint(0), Matrix([3, 5, 7, Rational(1, 2), -2, Rational(4, 3)])
    twice = call(link.double_angles, joint=joint)["twice"]
    angle = sympy.Symbol("angle")
    c, s = joint[2 * part : 2 * part + 2]
    turn = rotation(axis, angle).xreplace({sympy.cos(angle): c, sympy.sin(angle): s})
    found = link.turned_inertia(
        lambda _, value: value, axes, turn, twice[5 * part : 5 * part + 5], inertia
    )
    assert rotations.symmetric(found) == turn * rotations.symmetric(inertia) * turn.T


def composite(bodies, R, origin):
    """Mass, first moment and inertia about a point, in the axes of R, summed over bodies."""
    arms = [body.com[0] - origin for body in bodies]
    h = sum((body.mass * r for body, r in zip(bodies, arms, strict=True)), zeros(3, 1))
    spread = [
        body.mass * (r.dot(r) * eye(3) - r * r.T) for body, r in zip(bodies, arms, strict=True)
    ]
    inertia = sum(
        (b.R[0] * b.inertia * b.R[0].T + x for b, x in zip(bodies, spread, strict=True)),
        zeros(3, 3),
    )
    return (
        Matrix([sum(body.mass for body in bodies)]),
        R.T * h,
        rotations.entries(R.T * inertia * R),
    )


def momentum_about(origin, bodies, R):
    """Momentum of bodies and its moment about a point, in the axes of R."""
    moment = zeros(3, 1)
    for body in bodies:
        moment += body.spin + (body.com[0] - origin).cross(body.mass * body.com[1])
    return in_frame(R, Matrix.vstack(sum((b.mass * b.com[1] for b in bodies), zeros(3, 1)), moment))


def gathered_segment(state, i, beyond):
    """Apply gather_links over a segment; return what it carries and the sums of H_pp, H_py and
    H_yy.
    """
    twice = call(link.double_angles, joint=state.joint(i))["twice"]
    carried = {**beyond, "pitch": zeros(6, 1), "yaw": zeros(6, 1)}
    own = Counter()
    for _ in range(state.tail.links):
        found = call(
            link.gather_links, joint=state.joint(i), twice=twice, link=state.link(), **carried
        )
        carried = {name: found[name] for name in carried}
        own.update({name: found[name][0] for name in ("H_pp", "H_py", "H_yy")})
    return carried, own


def test_gathered_links_are_sums_over_the_links_from_definition():
    state = State(2, 3, seed=5)
    H, columns = state.mass_matrix(), state.columns()
    beyond = {"mass": zeros(1, 1), "h": zeros(3, 1), "I": zeros(6, 1)}
    for i in (1, 0):
        carried, own = gathered_segment(state, i, beyond)
        beyond = {name: carried[name] for name in beyond}
        pitch, yaw, first = 6 + 2 * i, 7 + 2 * i, 1 + i * state.tail.links
        parent = columns[pitch][first - 1]
        R, root = parent.R[0], parent.end[0]
        assert tuple(beyond.values()) == composite(columns[pitch][first:], R, root)
        assert carried["pitch"] == momentum_about(root, columns[pitch][first:], R)
        assert carried["yaw"] == momentum_about(root, columns[yaw][first:], R)
        assert own == {"H_pp": H[pitch, pitch], "H_py": H[pitch, yaw], "H_yy": H[yaw, yaw]}
        found = call(
            link.gather_moment, joint=state.joint(i), link=state.link(), mass=[0], h=zeros(3, 1)
        )
        last = columns[pitch][first + state.tail.links - 1]
        before = columns[pitch][first + state.tail.links - 2]
        assert (found["mass"], found["h"]) == composite([last], before.R[0], last.joint[0])[:2]


# Functions, from definition.


def world_map(state):
    """(p_dot, omega body, q_t_dot) to (p_dot, omega world, q_t_dot)."""
    return diag(eye(3), state.bodies()[0].R[0], eye(state.tail.nt))


def test_mass_matrix_is_the_form_of_kinetic_energy(state):
    nv, H = state.tail.nv, state.mass_matrix()
    assert Matrix(nv, nv, list(run("mass_matrix", state)["H"])) == H
    to_world = world_map(state)
    assert Matrix(nv, nv, list(run("mass_matrix_world", state)["H"])) == to_world * H * to_world.T


def test_inverse_dynamics_is_virtual_work(state):
    assert run("inverse_dynamics", state)["force"] == state.force(state.v_dot)
    C = state.force(zeros(state.tail.nv, 1))
    assert run("bias_force", state)["force"] == C
    assert run("bias_force_world", state)["force"] == world_map(state) * C


def test_forward_dynamics_solves_the_equations_of_motion(state):
    tau = Matrix.vstack(zeros(6, 1), state.tau)
    assert state.force(run("forward_dynamics", state)["v_dot"]) == tau
    J, f = state.point_jacobian(), state.f_ext
    at_torso = Matrix.vstack(f[:6, :], zeros(state.tail.nt, 1))
    assert (
        state.force(run("forward_dynamics_external", state)["v_dot"])
        == tau + at_torso + J.T * f[6:, :]
    )


def test_tail_points_and_their_jacobians(state):
    points = Matrix.vstack(*(body.end[0] for body in state.bodies()))
    assert run("tail_points", state)["points"] == points
    J = Matrix(
        3 * (state.tail.total + 1), state.tail.nv, list(run("tail_point_jacobians", state)["J"])
    )
    assert state.point_jacobian() == J


def test_energy_and_momentum_are_sums_over_bodies(state):
    bodies = state.bodies(state.v)
    height = sum(body.mass * body.com[0][2] for body in bodies)
    energy = run("energy", state)
    assert energy["kinetic"][0] == kinetic_form(bodies, bodies) / 2
    assert energy["potential"][0] == state.parameters["gravity"][0] * height
    mass = sum(body.mass for body in bodies)
    com = sum((body.mass / mass * body.com[0] for body in bodies), zeros(3, 1))
    expected = momentum_about(com, bodies, eye(3))
    momentum = run("momentum", state)
    assert Matrix.vstack(momentum["linear"], momentum["angular"]) == expected


# Lowering.


def lowered(e, **numbers):
    """Lower an expression and evaluate it at numbers."""
    recorder = Recorder()
    symbols = {
        name: recorder.symbol(name, recorder.tape.input(k)) for k, name in enumerate(numbers)
    }
    node = recorder.lower(sympy.sympify(e, locals=symbols))
    return replay(recorder.tape.nodes, list(numbers.values()), EXACT)[node]


@pytest.mark.parametrize(
    "text",
    [
        "x + y - 3*x*y",
        "2*x/3",
        "-x/y",
        "x**3",
        "x**-2",
        "y/(3*x)",
        "1/(x + y)",
        "x*y/(x - y)/2",
        "(x + 1)**2*y",
        "-3",
    ],
)
def test_lowering_keeps_the_value(text):
    x, y = Rational(3, 7), Rational(-5, 2)
    assert lowered(text, x=x, y=y) == sympy.sympify(text).subs({"x": x, "y": y})


@pytest.mark.parametrize("text", ["tan(x)", "x**y", "x**Rational(1, 3)", "exp(x)", "pi*x"])
def test_what_has_no_rule_is_refused(text):
    with pytest.raises(TypeError, match="no rule lowers"):
        lowered(text, x=1, y=1)


def test_let_names_what_is_not_a_symbol_or_number():
    recorder = Recorder()
    x, y = recorder.vector("x", 0, 2)
    named = recorder.let("m", Matrix([[x, 2], [x * y, x + y]]))
    assert (named[0, 0], named[0, 1]) == (x, 2)
    assert named[1, 0].is_Symbol and named[1, 1].is_Symbol and named[1, 0] != named[1, 1]
    assert recorder.lower(named[1, 0]) == recorder.lower(x * y)


# Steps as a whole.


def applied_steps():
    """Every step that a function applies, for several sizes."""
    for tail in (Tail(1, 1), Tail(1, 3), Tail(3, 2), Tail(2, 3, "continuum")):
        for function in FUNCTIONS.values():
            for statement, _ in statements(assemble(function, tail).body):
                if isinstance(statement, Apply):
                    yield statement.step


def test_a_name_means_one_step():
    steps = {}
    for step in applied_steps():
        assert steps.setdefault(step.name, step) == step
    assert len(steps) > 40


def test_derived_steps_are_named_after_their_function():
    step = derive(link.link_wrench)
    assert (step.name, step.outputs) == ("link_wrench", (("F", 6),))
    assert step.inputs == (("link", 6), ("w", 3), ("w_dot", 3), ("a_joint", 3), ("swing", 3))
    assert (
        step.doc
        == "Inertial wrench of one link at its joint (Eq. 17), Newton and Euler in the link frame."
    )
    assert derive(link.link_wrench) is step


# Costs: additions, subtractions, multiplications and divisions.


class Counting:
    """The algebra that counts its operations."""

    def __init__(self):
        self.count = 0

    def __getattr__(self, op):
        def applied(*_):
            self.count += op in ("add", "sub", "mul", "div")

        return applied


def executed(name, m, n):
    """Operations that a function executes in loops."""
    p, algebra = assemble(FUNCTIONS[name], Tail(m, n)), Counting()
    Run(
        p,
        algebra,
        {a.name: [None] * a.length for a in (*p.of_role("parameters"), *p.of_role("input"))},
    )
    return algebra.count


def straight(name, m, n):
    """Operations of a function without loops."""
    tape, outputs, guards = unroll(assemble(FUNCTIONS[name], Tail(m, n)))
    guarded = [node for _, node in guards]
    return operation_count(
        tape.nodes, [node for nodes in outputs.values() for node in nodes] + guarded
    )


def step_cost(*functions):
    """Operations of derived steps."""
    return sum(operation_count(step.nodes, step.results) for step in map(derive, functions))


def test_steps_stay_within_their_budgets():
    assert step_cost(link.gather_links) <= 140
    assert step_cost(link.link_motion, link.link_wrench) <= 95
    assert step_cost(link.gather_wrench) <= 36


def test_functions_stay_within_their_budgets():
    assert straight("forward_dynamics", 1, 3) <= 1040
    assert executed("forward_dynamics", 3, 4) <= 5340


# Choices.


@pytest.mark.parametrize("y", [-1.0, 0.0, 2.0])
@pytest.mark.parametrize("x", [-1.0, 0.0, 2.0])
def test_choices_are_lowered_as_sympy_means_them(x, y):
    a, b = sympy.symbols("a b")
    choices = [
        sympy.Piecewise((a, a > b), (b + 1, True)),
        sympy.Piecewise((a, a >= b), (b + 1, True)),
        sympy.Piecewise((a, a < b), (b + 1, True)),
        sympy.Piecewise((a, b <= a), (3, a < 0), (b + 1, True)),
        sympy.Max(a, b),
        sympy.Max(a, b, 1) - sympy.Max(a * b, -1),
    ]
    recorder = Recorder()
    recorder.node_of |= {symbol: recorder.tape.input(k) for k, symbol in enumerate((a, b))}
    nodes = [recorder.lower(e) for e in choices]
    found = replay(recorder.tape.nodes, [x, y], Numbers(math, float))
    assert [found[n] for n in nodes] == [float(e.subs({a: x, b: y})) for e in choices]


@pytest.mark.parametrize(
    "e", ["Piecewise((a, a > 0))", "Piecewise((a, Eq(a, b)), (b, True))", "Min(a, b)"]
)
def test_choices_that_no_rule_lowers_are_refused(e):
    recorder = Recorder()
    symbols = {name: recorder.symbol(name, recorder.tape.input(k)) for k, name in enumerate("ab")}
    with pytest.raises(TypeError, match="no rule lowers"):
        recorder.lower(sympy.sympify(e, locals=symbols))

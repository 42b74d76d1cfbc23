"""Every step equals its definition, exactly, in rational arithmetic."""

from collections import Counter

import pytest
import sympy
from sympy import Matrix, Rational, eye, zeros
from sympy.algebras.quaternion import Quaternion

from serpentail_codegen.mechanics import link, rotations, torso

from .exact import State, X, Z, call, in_frame, kinetic_form, momentum_about, rotation

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

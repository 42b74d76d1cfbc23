"""Laws of place and axes: results do not depend on the origin and axes of the world.

Also laws of the tail's points, and of loads on them.
"""

from dataclasses import replace

import numpy as np

from serpentail_scene.layout import OMEGA, POSITION, QUATERNION, TAIL_Q, TORSO_NV, VELOCITY

from ..basics.attitude import pose_of, product, rotation_matrix
from ..model.chains import values_of
from ..model.model import Model
from ..model.weight import fall, total_mass
from .errors import (
    block_error,
    difference,
    differences,
    matrix_error,
    relative,
    same_bits,
    turned_array,
    worst,
)
from .law import VALUE_LIMIT, Errors, fastest, law, slope
from .states import Case, at_origin, functions_of, outputs

WORLD = ("mass_matrix_world", "bias_force_world")
# results that depend on position and velocity of B
PLACED = (
    "energy",
    "energy_derivatives",
    "momentum",
    "center_of_mass",
    "tail_points",
    "contact_points",
)


def changed_axes(top: np.ndarray, middle: np.ndarray, size: int) -> np.ndarray:
    """Return blkdiag(top, middle, 1), by which a change of axes acts on velocities and forces."""
    X = np.eye(size)
    X[VELOCITY, VELOCITY], X[OMEGA, OMEGA] = top, middle
    return X


@law(units=VALUE_LIMIT, only="free", without=("air",))
def pose_in_the_world_turns_all_alike(model: Model, s: Case) -> Errors:
    """Turning the world about z and shifting it turns and shifts every result."""
    angle, shift = 1.1, np.array([0.3, -0.7, 0.5])
    c, n = np.cos(angle), np.sin(angle)
    Z = np.array([[c, -n, 0], [n, c, 0], [0, 0, 1]])
    half = np.array([np.cos(angle / 2), 0, 0, np.sin(angle / 2)])
    q = np.concatenate([Z @ s.q[POSITION] + shift, product(half, s.q[QUATERNION]), s.q[TAIL_Q]])
    X = changed_axes(Z, np.eye(3), model.nv)
    loads = s.f_ext.reshape(-1, 3) @ Z.T
    loads[1:2] = s.f_ext[OMEGA]  # the moment, in body axes
    turned = replace(s, q=q, f_ext=loads.ravel())
    turned = replace(
        turned, **{name: X @ getattr(s, name) for name in ("v", "v_dot", "dq", "dv", "multiplier")}
    )
    errors, other = {}, model
    if "gravity_vector" in model.parameters:  # it turns with the world
        other = model.with_parameters(gravity_vector=Z @ fall(model.parameters))
    for name in functions_of(model):
        axes = changed_axes(Z, Z if name in WORLD else np.eye(3), model.nv)
        expected = turned_outputs(model, outputs(model, name, s), axes, shift)
        errors[name] = differences(other, name, turned, expected.values())
    return errors


def turned_outputs(model: Model, results: dict, X: np.ndarray, shift: np.ndarray) -> dict:
    """Return the outputs transformed to a world rotated by X's first block and shifted."""
    Z = X[VELOCITY, VELOCITY]
    pull = Z @ fall(model.parameters) * total_mass(model.parameters)
    world = 3 * ("gravity_vector" in model.parameters)  # first columns, of a vector of the world
    turn = {
        "potential": lambda V: V - pull @ shift,
        **dict.fromkeys(("points", "positions", "position"), lambda p: p @ Z.T + shift),
        "velocities": lambda u: u @ Z.T,
        "J": lambda J: Z @ J @ X.T,
        "dparameters": lambda D: X @ np.hstack([D[:, :world] @ Z.T[:world, :world], D[:, world:]]),
        # in torso axes, and of the tail alone
        **dict.fromkeys(("mount_force", "mount_moment", "lengths", "B"), lambda f: f),
    }
    return {key: turn[key](x) if key in turn else turned_array(x, X) for key, x in results.items()}


@law(only="free", without=("air",))
def position_and_speed_of_the_torso_do_not_matter(model: Model, s: Case) -> Errors:
    """H, C, v_dot and Jacobians do not change with B's position and velocity, bit for bit."""
    q, v = s.q.copy(), s.v.copy()
    q[POSITION] += 5.0
    v[VELOCITY] -= 3.0
    names = [name for name in functions_of(model) if name not in PLACED]
    if "air_density" in model.parameters:  # which derivatives by it depend on
        names = [name for name in names if "parameter_derivatives" not in name]
    return same_bits(model, names, s, replace(s, q=q, v=v))


@law(only="free")
def quaternion_has_no_norm_and_no_sign(model: Model, s: Case) -> Errors:
    """The quaternion times -2 is the same attitude: the same results, bit for bit."""
    q = s.q.copy()
    q[QUATERNION] *= -2
    return same_bits(model, functions_of(model), s, replace(s, q=q))


@law("tail_points", VALUE_LIMIT, only="articulated")
def links_have_their_length(model: Model, s: Case) -> Errors:
    """The first point of a chain of links is its mount, and each is a link from the next: L / N, or
    its own length.
    """
    every, pose = model.tail_points(s.q).astype(float), pose_of(s.q, model.layout)
    mounts, lengths = [], []
    for chain in model.layout.chains:
        if {*model.kinds[chain.segments]} != {"articulated"}:
            continue
        p, points = values_of(chain, model.parameters), every[chain.points]
        mount = np.array(p["tail_mount"]) * (-1 if chain.mirrored else 1, 1, 1)
        there = pose[POSITION] + rotation_matrix(pose[QUATERNION]) @ mount
        found = np.linalg.norm(np.diff(points, axis=0), axis=1)
        wanted = p.get("link_lengths", np.full(len(found), p["tail_length"] / len(found)))
        mounts.append(relative(points[0], there, points))
        lengths.append(relative(found, np.array(wanted), points))
    return {"mount": worst(mounts), "lengths": worst(lengths)}


@law("tail_points tail_point_jacobians", VALUE_LIMIT)
def jacobians_are_the_derivatives_of_the_points(model: Model, s: Case) -> Errors:
    """J v is the derivative of the tail points along each unit velocity, relative to |points| times
    the links' turn.
    """
    q = at_origin(s).q
    J, errors = model.tail_point_jacobians(q), []
    for k, unit in enumerate(np.eye(model.nv)):
        rate = max(1.0, fastest(model, unit))

        def points(time: float, v: np.ndarray = unit) -> np.ndarray:
            return model.tail_points(model.integrate(q, v, time)).astype(float)

        column, largest = slope(points, rate)
        errors.append(relative(J[:, :, k], column, rate * largest))
    return worst(errors)


@law("mass_matrix forward_dynamics forward_dynamics_external tail_point_jacobians", VALUE_LIMIT)
def loads_accelerate_by_their_generalised_force(model: Model, s: Case) -> Errors:
    """H (v_dot under loads - v_dot without) = [f; n; 0] + sum J_k^T f_k, relative to cond(H)."""
    H, J = model.mass_matrix(s.q).astype(float), model.tail_point_jacobians(s.q)
    force = np.einsum("kxi,kx->i", J, s.f_ext[TORSO_NV:].reshape(-1, 3))
    force[:TORSO_NV] += s.f_ext[:TORSO_NV]
    free = model.forward_dynamics(s.q, s.v, s.tau)
    loaded = model.forward_dynamics(s.q, s.v, s.tau, s.f_ext)
    return difference(model, s.q, "v_dot", loaded, free + np.linalg.solve(H, force))


@law("forward_dynamics forward_dynamics_external", VALUE_LIMIT)
def no_load_is_no_change(model: Model, s: Case) -> Errors:
    """Forward dynamics under zero loads is forward dynamics, relative to cond(H)."""
    free = model.forward_dynamics(s.q, s.v, s.tau)
    return difference(
        model, s.q, "v_dot", model.forward_dynamics(s.q, s.v, s.tau, 0 * s.f_ext), free
    )


@law("mass_matrix mass_matrix_world", VALUE_LIMIT)
def mass_matrix_in_world_axes(model: Model, s: Case) -> Errors:
    """The world-frame H is X^-T H X^-1 with X = blkdiag(1, R, 1)."""
    X = changed_axes(np.eye(3), rotation_matrix(s.q[QUATERNION]), model.nv)
    return matrix_error(model.mass_matrix_world(s.q), X @ model.mass_matrix(s.q) @ X.T)


@law("bias_force bias_force_world", VALUE_LIMIT)
def bias_force_in_world_axes(model: Model, s: Case) -> Errors:
    """The world-frame C is X^-T C: d(R omega)/dt = R omega_dot, so that X_dot adds nothing."""
    X = changed_axes(np.eye(3), rotation_matrix(s.q[QUATERNION]), model.nv)
    return block_error(model.bias_force_world(s.q, s.v), X @ model.bias_force(s.q, s.v))

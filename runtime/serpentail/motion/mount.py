"""What the tail exerts on the torso along a motion."""

from typing import Any

import numpy as np

from serpentail_scene.layout import OMEGA, POSITION, QUATERNION, VELOCITY

from ..basics.attitude import Array, pose_of, rotation_matrix
from ..model.model import Model
from .given import loads_at


def mount_wrenches(model: Model, motion: Any) -> tuple[Array, Array]:
    """Return force (K, 3), N, and moment (K, 3), N m, of the tail at its mount, torso axes."""
    pose, contact = pose_of(motion.q, model.layout), motion.contact
    given, loads = motion.given, loads_at(motion.info, motion.t)
    if contact is None and loads is None:
        v_dot = model.forward_dynamics(motion.q, motion.v, motion.tau, None, *given)
        return model.mount_wrench(motion.q, motion.v, v_dot, *given)
    R, points = rotation_matrix(pose[:, QUATERNION]), model.tail_points(motion.q, *given)
    count: int = points.shape[1]

    # the ground and loads push on the torso, by massless legs too, and on a chain's points
    f_ext = np.zeros((len(pose), 6 + points[0].size))
    forces = f_ext[:, 6:].reshape(points.shape)
    on_feet: Any = 0.0
    if loads is not None:
        f_ext[:, VELOCITY] = loads[:, :3]
        turned = loads[:, 3:12].reshape(-1, 3, 3) @ R
        skew = turned - turned.swapaxes(1, 2)
        f_ext[:, OMEGA] = np.stack([skew[:, 1, 2], skew[:, 2, 0], skew[:, 0, 1]], axis=1)
        each: Any = loads[:, 12:].reshape(len(pose), -1, 3)
        forces += each[:, :count]
        on_feet = each[:, count:]
    chains = {chain.name: chain.points for chain in model.layout.chains}
    for group in contact.groups if contact else ():
        part = contact.of(group)
        if group in chains:
            forces[:, chains[group]][:, 1:] += part.forces
            continue
        arms = part.points - pose[:, None, POSITION]
        pushes = part.forces + (on_feet if group == "feet" else 0.0)
        f_ext[:, VELOCITY] += pushes.sum(axis=1)
        moment = np.cross(arms, pushes).sum(axis=1)
        f_ext[:, OMEGA] += np.einsum("kji,kj->ki", R, moment)
    v_dot = model.forward_dynamics(motion.q, motion.v, motion.tau, f_ext, *given)
    force, moment = model.mount_wrench(motion.q, motion.v, v_dot, *given)

    # the torso holds what pushes on the tail
    own = model.layout.chains[0].points
    forces, arms = forces[:, own], points[:, own] - points[:, :1]
    force = force + np.einsum("kji,kpj->ki", R, forces)
    return force, moment + np.einsum("kji,kpj->ki", R, np.cross(arms, forces))

"""What the tail exerts on the torso along a motion."""

from typing import Any

import numpy as np

from serpentail_scene.layout import POSITION, QUATERNION, VELOCITY

from ..basics.attitude import Array, pose_of, rotation_matrix
from ..model.model import Model


def mount_wrenches(model: Model, motion: Any) -> tuple[Array, Array]:
    """Return force (K, 3), N, and moment (K, 3), N m, of the tail at its mount, torso axes."""
    pose, contact = pose_of(motion.q, model.layout), motion.contact
    given = motion.given
    if contact is None:
        v_dot = model.forward_dynamics(motion.q, motion.v, motion.tau, None, *given)
        return model.mount_wrench(motion.q, motion.v, v_dot, *given)
    R, points = rotation_matrix(pose[:, QUATERNION]), model.tail_points(motion.q, *given)

    # the ground pushes on the torso, by massless legs too, and on a chain's points but the first
    f_ext = np.zeros((len(pose), 6 + points[0].size))
    forces = f_ext[:, 6:].reshape(points.shape)
    chains = {chain.name: chain.points for chain in model.layout.chains}
    for group in contact.groups:
        part = contact.of(group)
        if group in chains:
            forces[:, chains[group]][:, 1:] = part.forces
            continue
        arms = part.points - pose[:, None, POSITION]
        f_ext[:, VELOCITY] += part.forces.sum(axis=1)
        moment = np.cross(arms, part.forces).sum(axis=1)
        f_ext[:, 3:6] += np.einsum("kji,kj->ki", R, moment)
    v_dot = model.forward_dynamics(motion.q, motion.v, motion.tau, f_ext, *given)
    force, moment = model.mount_wrench(motion.q, motion.v, v_dot, *given)

    # the torso holds what pushes on the tail
    own = model.layout.chains[0].points
    forces, arms = forces[:, own], points[:, own] - points[:, :1]
    force = force + np.einsum("kji,kpj->ki", R, forces)
    return force, moment + np.einsum("kji,kpj->ki", R, np.cross(arms, forces))

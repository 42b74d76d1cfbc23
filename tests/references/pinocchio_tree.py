"""A torso with several chains of links by Pinocchio: a tree of hinges, reduced to shared angles."""

import numpy as np
import pinocchio as pin

from .body_set import Hinge

MIRROR = np.diag([-1.0, 1.0, 1.0])


class PinocchioTree:
    """A free-flyer with two hinges (x, then z) for each link; G repeats the angles of a segment.

    ``animal`` is the description of `body_set`; its segments are lists of links, or hinges.
    """

    def __init__(self, animal):
        """Add chain after chain; what is mirrored has mirrored places and axes."""
        self.model = pin.Model()
        self.model.gravity.linear = np.array([0, 0, -animal.gravity])
        torso = self.model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "torso")
        body = pin.Inertia(animal.torso_mass, np.zeros(3), np.diag(animal.torso_inertia))
        self.model.appendBodyToJoint(torso, body, pin.SE3.Identity())
        columns, count = [], 0
        for chain in animal._all:
            pitch, roll, yaw = chain.mount_angles
            turn = pin.rpy.rpyToMatrix(0, 0, yaw) @ pin.rpy.rpyToMatrix(pitch, 0, 0)
            turn = turn @ pin.rpy.rpyToMatrix(0, roll, 0)
            F = MIRROR if chain.mirrored else np.eye(3)
            joint, place = torso, pin.SE3(F @ turn @ F, F @ np.array(chain.mount))
            for segment in chain.segments:
                if isinstance(segment, Hinge):
                    axis = np.linalg.det(F) * F @ np.eye(3)[segment.axis]
                    hinge = pin.JointModelRevoluteUnaligned(axis)
                    joint = self.model.addJoint(joint, hinge, place, str(self.model.njoints))
                    columns.append(count)
                    center = F @ np.array(segment.center)
                    body = pin.Inertia(segment.mass, center, np.diag(segment.inertia))
                    self.model.appendBodyToJoint(joint, body, pin.SE3.Identity())
                    place = pin.SE3(np.eye(3), F @ np.array(segment.tip))
                    count += 1
                    continue
                for link in segment:
                    for k, axis in enumerate(np.eye(3)[[0, 2]]):
                        hinge = pin.JointModelRevoluteUnaligned(np.linalg.det(F) * F @ axis)
                        name = str(self.model.njoints)
                        joint = self.model.addJoint(joint, hinge, place, name)
                        columns.append(count + k)
                        place = pin.SE3.Identity()
                    center = np.array([0, -link.center, 0])
                    body = pin.Inertia(link.mass, center, np.diag(link.inertia))
                    self.model.appendBodyToJoint(joint, body, pin.SE3.Identity())
                    place = pin.SE3(np.eye(3), np.array([0, -link.length, 0]))
                count += 2
        self.G = np.eye(count)[columns]
        self.data = self.model.createData()

    def _full(self, q):
        """The configuration of all hinges, and the map from v to their velocities."""
        w, x, y, z = q[3:7] / np.linalg.norm(q[3:7])
        R = pin.Quaternion(w, x, y, z).matrix()
        T = np.zeros((self.model.nv, 6 + self.G.shape[1]))
        T[:3, :3], T[3:6, 3:6], T[6:, 6:] = R.T, np.eye(3), self.G
        return np.concatenate([q[:3], [x, y, z, w], self.G @ q[7:]]), T

    def mass_matrix(self, q):
        """H."""
        full, T = self._full(q)
        upper = np.triu(pin.crba(self.model, self.data, full, pin.Convention.LOCAL))
        return T.T @ (upper + np.triu(upper, 1).T) @ T

    def inverse_dynamics(self, q, v, v_dot):
        """H v_dot + C."""
        full, T = self._full(q)
        acceleration = T @ v_dot
        acceleration[:3] -= np.cross(v[3:6], (T @ v)[:3])
        return T.T @ pin.rnea(self.model, self.data, full, T @ v, acceleration)

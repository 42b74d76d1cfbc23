"""A torso with one chain of links or several by Pinocchio: a tree of hinges, reduced to shared
angles.
"""

import numpy as np
import pinocchio as pin
from scipy.linalg import cho_factor, cho_solve

from .body_set import Animal, Hinge, Link

MIRROR = np.diag([-1.0, 1.0, 1.0])
STILL = pin.SE3.Identity()


class PinocchioTree:
    """A free-flyer with two hinges (x, then z) for each link; G repeats the angles of a segment.

    ``animal`` is the description of `body_set`; its segments are lists of links, or hinges.
    ``gravity`` is a vector, m/s^2, in place of the animal's.
    """

    def __init__(self, animal, gravity=None):
        """Add chain after chain; what is mirrored has mirrored places and axes."""
        self.model, self.points = pin.Model(), []
        self.model.gravity.linear = np.array(gravity or (0, 0, -animal.gravity))
        torso = self.model.addJoint(0, pin.JointModelFreeFlyer(), STILL, "torso")
        body = pin.Inertia(animal.torso_mass, np.zeros(3), np.diag(animal.torso_inertia))
        self.model.appendBodyToJoint(torso, body, STILL)
        columns, count = [], 0
        for chain in animal._all:
            pitch, roll, yaw = chain.mount_angles
            turn = pin.rpy.rpyToMatrix(0, 0, yaw) @ pin.rpy.rpyToMatrix(pitch, 0, 0)
            turn = turn @ pin.rpy.rpyToMatrix(0, roll, 0)
            F = MIRROR if chain.mirrored else np.eye(3)
            joint, place = torso, pin.SE3(F @ turn @ F, F @ np.array(chain.mount))
            self._add_point(joint, place)
            for segment in chain.segments:
                own = _hinges(segment)
                width = min(len(own), 2)
                for k, hinge in enumerate(own):
                    axis = np.linalg.det(F) * F @ np.eye(3)[hinge.axis]
                    turning = pin.JointModelRevoluteUnaligned(axis)
                    joint = self.model.addJoint(joint, turning, place, str(self.model.njoints))
                    columns.append(count + k % width)
                    center = F @ np.array(hinge.center)
                    body = pin.Inertia(hinge.mass, center, np.diag(hinge.inertia))
                    self.model.appendBodyToJoint(joint, body, STILL)
                    place = pin.SE3(np.eye(3), F @ np.array(hinge.tip))
                    if hinge.mass or segment is hinge:
                        self._add_point(joint, place)
                count += width
        self.G = np.eye(count)[columns]
        self.data = self.model.createData()

    def _add_point(self, joint, place):
        """Note a fixed place of a joint's frame."""
        frame = pin.Frame(f"point {len(self.points)}", joint, place, pin.FrameType.OP_FRAME)
        self.points.append(self.model.addFrame(frame))

    def _full(self, q):
        """The configuration of all hinges, and T with v_full = T v = [R^T p_dot, omega, G v_t]."""
        w, x, y, z = q[3:7] / np.linalg.norm(q[3:7])
        R = pin.Quaternion(w, x, y, z).matrix()
        T = np.zeros((self.model.nv, 6 + self.G.shape[1]))
        T[:3, :3], T[3:6, 3:6], T[6:, 6:] = R.T, np.eye(3), self.G
        return np.concatenate([q[:3], [x, y, z, w], self.G @ q[7:]]), T

    def mass_matrix(self, q):
        """H = T^T H_full T."""
        full, T = self._full(q)
        # LOCAL: WORLD sums inertias about the world origin, which costs two digits when p
        # is a metre away
        upper = np.triu(pin.crba(self.model, self.data, full, pin.Convention.LOCAL))
        return T.T @ (upper + np.triu(upper, 1).T) @ T

    def bias_force(self, q, v):
        """C, gravity included: the inverse dynamics at v_dot = 0."""
        return self.inverse_dynamics(q, v, np.zeros(len(v)))

    def inverse_dynamics(self, q, v, v_dot):
        """H v_dot + C = T^T rnea(q_full, T v, T v_dot + T_dot v)."""
        full, T = self._full(q)
        acceleration = T @ v_dot
        # d(R^T p_dot)/dt = R^T p_ddot - omega x R^T p_dot
        acceleration[:3] -= np.cross(v[3:6], (T @ v)[:3])
        return T.T @ pin.rnea(self.model, self.data, full, T @ v, acceleration)

    def mount_wrench(self, q, v, v_dot):
        """(force, moment) of the tail on the torso at the mount, torso axes."""
        self.inverse_dynamics(q, v, v_dot)
        turn, first = self.data.liMi[2].rotation, self.data.f[2]  # of the torso on the first joint
        return -turn @ first.linear, -turn @ first.angular

    def forward_dynamics(self, q, v, tau):
        """v_dot of H v_dot + C = [0; tau]."""
        force = np.concatenate([np.zeros(6), tau]) - self.bias_force(q, v)
        return cho_solve(cho_factor(self.mass_matrix(q)), force)

    def energy(self, q, v):
        """(kinetic, potential), the potential sum m g z."""
        full, T = self._full(q)
        kinetic = pin.computeKineticEnergy(self.model, self.data, full, T @ v)
        return kinetic, pin.computePotentialEnergy(self.model, self.data, full)

    def momentum(self, q, v):
        """(linear, angular about the COM), in world axes."""
        full, T = self._full(q)
        centroidal = pin.computeCentroidalMomentum(self.model, self.data, full, T @ v)
        return centroidal.linear.copy(), centroidal.angular.copy()

    def center_of_mass(self, q, v):
        """(position, velocity, J) of the centre of mass, in world axes."""
        full, T = self._full(q)
        pin.centerOfMass(self.model, self.data, full, T @ v)
        position, velocity = self.data.com[0].copy(), self.data.vcom[0].copy()
        return position, velocity, pin.jacobianCenterOfMass(self.model, self.data, full) @ T

    def tail_points(self, q):
        """World positions (N+1, 3) of the N joints and the tip."""
        pin.framesForwardKinematics(self.model, self.data, self._full(q)[0])
        return np.array([self.data.oMf[point].translation for point in self.points])

    def tail_point_jacobians(self, q):
        """J (N+1, 3, nv) of the tail points, world axes: d(point)/dt = J v."""
        full, T = self._full(q)
        pin.computeJointJacobians(self.model, self.data, full)
        pin.updateFramePlacements(self.model, self.data)
        axes = pin.LOCAL_WORLD_ALIGNED
        found = [pin.getFrameJacobian(self.model, self.data, p, axes)[:3] for p in self.points]
        return np.array(found) @ T


def chain(parameters, segments, links):
    """The peer of a tail of equal links; of an ellipsoid (r, L/2, r) as Pinocchio knows it, if no
    inertia is given.
    """
    count = segments * links
    mass, length = parameters["tail_mass"] / count, parameters["tail_length"] / count
    moments = parameters.get("link_inertia")
    if moments is None:
        radius = parameters["link_radius"]
        moments = pin.Inertia.FromEllipsoid(mass, radius, length / 2, radius).inertia.diagonal()
    segment = [Link(mass, length, length / 2, tuple(moments))] * links
    torso = {name: parameters[name] for name in ("torso_mass", "torso_inertia", "tail_mount")}
    animal = Animal(segments=(segment,) * segments, gravity=parameters["gravity"], **torso)
    peer = PinocchioTree(animal, parameters.get("gravity_vector"))
    peer.G *= np.resize(np.repeat(parameters.get("joint_ratios", 1), 2), (2 * count, 1))
    return peer


def _hinges(segment):
    """A segment as hinges: each link is two at one place, of which the second carries it."""
    if isinstance(segment, Hinge):
        return [segment]
    found = []
    for link in segment:
        along = (0.0, -link.center, 0.0), link.inertia, (0.0, -link.length, 0.0)
        found += [Hinge(0), Hinge(2, link.mass, *along)]
    return found

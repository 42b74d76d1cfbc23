"""From parameters and (m, n) to the articulated tail's dynamics, by Pinocchio on a reduced revolute
chain.
"""

import numpy as np
import pinocchio as pin
from scipy.linalg import cho_factor, cho_solve


class PinocchioChain:
    """A free-flyer with 2 m n revolute joints (RX, RZ alternating), reduced to nv = 6 + 2m by G."""

    def __init__(self, parameters, segments, links):
        """Build the full chain and the matrix G: k_j (alpha_i, beta_i) for joint j of segment i."""
        self.segments, self.links = segments, links
        self.nq, self.nv = 7 + 2 * segments, 6 + 2 * segments
        self.repeat = np.kron(np.kron(np.eye(segments), np.ones((links, 1))), np.eye(2))
        ratios = np.repeat(parameters.get("joint_ratios", 1), 2)
        self.repeat *= np.resize(ratios, (len(self.repeat), 1))
        self.model, self.points = _build(parameters, segments * links)
        self.data = self.model.createData()

    def mass_matrix(self, q):
        """H = T^T H_full T."""
        full_q, transform = self._full_configuration(q)
        # LOCAL: WORLD sums inertias about the world origin, which costs two digits when p
        # is a metre away
        upper = np.triu(pin.crba(self.model, self.data, full_q, pin.Convention.LOCAL))
        full_mass = upper + np.triu(upper, 1).T
        return transform.T @ full_mass @ transform

    def bias_force(self, q, v):
        """C, gravity included: the inverse dynamics at v_dot = 0."""
        return self.inverse_dynamics(q, v, np.zeros(self.nv))

    def inverse_dynamics(self, q, v, v_dot):
        """H v_dot + C = T^T rnea(q_full, T v, T v_dot + T_dot v)."""
        full_q, transform = self._full_configuration(q)
        full_v, full_v_dot = transform @ v, transform @ v_dot
        # d(R^T p_dot)/dt = R^T p_ddot - omega x R^T p_dot
        full_v_dot[:3] -= np.cross(v[3:6], full_v[:3])
        return transform.T @ pin.rnea(self.model, self.data, full_q, full_v, full_v_dot)

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
        full_q, transform = self._full_configuration(q)
        kinetic = pin.computeKineticEnergy(self.model, self.data, full_q, transform @ v)
        return kinetic, pin.computePotentialEnergy(self.model, self.data, full_q)

    def momentum(self, q, v):
        """(linear, angular about the COM), in world axes."""
        full_q, transform = self._full_configuration(q)
        centroidal = pin.computeCentroidalMomentum(self.model, self.data, full_q, transform @ v)
        return centroidal.linear.copy(), centroidal.angular.copy()

    def center_of_mass(self, q, v):
        """(position, velocity, J) of the centre of mass, in world axes."""
        full_q, transform = self._full_configuration(q)
        pin.centerOfMass(self.model, self.data, full_q, transform @ v)
        position, velocity = self.data.com[0].copy(), self.data.vcom[0].copy()
        jacobian = pin.jacobianCenterOfMass(self.model, self.data, full_q)
        return position, velocity, jacobian @ transform

    def tail_points(self, q):
        """World positions (N+1, 3) of the N joints and the tip."""
        pin.framesForwardKinematics(self.model, self.data, self._full_configuration(q)[0])
        return np.array([self.data.oMf[point].translation for point in self.points])

    def tail_point_jacobians(self, q):
        """J (N+1, 3, nv) of the tail points, world axes: d(point)/dt = J v."""
        full_q, transform = self._full_configuration(q)
        pin.computeJointJacobians(self.model, self.data, full_q)
        pin.updateFramePlacements(self.model, self.data)
        found = [
            pin.getFrameJacobian(self.model, self.data, point, pin.LOCAL_WORLD_ALIGNED)[:3]
            for point in self.points
        ]
        return np.array(found) @ transform

    def _full_configuration(self, q):
        """q_full, its quaternion (x, y, z, w), and T with v_full = T v = [R^T p_dot, omega, G
        q_t_dot].
        """
        w, x, y, z = q[3:7] / np.linalg.norm(q[3:7])
        transform = np.zeros((self.model.nv, self.nv))
        transform[:3, :3] = pin.Quaternion(w, x, y, z).toRotationMatrix().T
        transform[3:6, 3:6] = np.eye(3)
        transform[6:, 6:] = self.repeat
        return np.concatenate([q[:3], [x, y, z, w], self.repeat @ q[7:]]), transform


def _build(parameters, count):
    """Pinocchio's model of the torso and `count` links, and the frame ids of the tail points."""
    model, still = pin.Model(), pin.SE3.Identity()
    level = (0.0, 0.0, -parameters["gravity"])
    model.gravity.linear = np.array(parameters.get("gravity_vector", level))
    joint = model.addJoint(0, pin.JointModelFreeFlyer(), still, "torso")
    torso = np.diag(parameters["torso_inertia"])  # about B, its COM
    model.appendBodyToJoint(joint, pin.Inertia(parameters["torso_mass"], np.zeros(3), torso), still)
    points, place = [], pin.SE3(np.eye(3), np.array(parameters["tail_mount"], dtype=float))
    for index in range(count):
        points.append(_add_point(model, joint, place, index))
        pitch = model.addJoint(joint, pin.JointModelRX(), place, f"alpha_{index}")
        joint = model.addJoint(pitch, pin.JointModelRZ(), still, f"beta_{index}")
        model.appendBodyToJoint(joint, _link_inertia(parameters, count), still)
        place = pin.SE3(np.eye(3), np.array([0.0, -parameters["tail_length"] / count, 0.0]))
    return model, [*points, _add_point(model, joint, place, count)]


def _add_point(model, joint, place, index):
    """A frame at a fixed place of a joint's frame; its id."""
    return model.addFrame(pin.Frame(f"point_{index}", joint, place, pin.FrameType.OP_FRAME))


def _link_inertia(parameters, count):
    """One link's inertia, its COM mid-link: the given diagonal, or Pinocchio's own ellipsoid (r,
    L/2, r).
    """
    mass, half = parameters["tail_mass"] / count, parameters["tail_length"] / count / 2
    diagonal = parameters.get("link_inertia")
    if diagonal is None:
        radius = parameters["link_radius"]
        rotational = pin.Inertia.FromEllipsoid(mass, radius, half, radius).inertia
    else:
        rotational = np.diag(diagonal)
    return pin.Inertia(mass, np.array([0.0, -half, 0.0]), rotational)

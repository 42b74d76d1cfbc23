"""Dynamics of the articulated tail from parameters and (m, n), by MuJoCo on a reduced chain of
hinges.
"""

import mujoco
import numpy as np
from scipy.linalg import cho_factor, cho_solve


class MujocoChain:
    """A free joint with 2 m n unlimited hinges, no constraint of any kind, reduced to nv = 6 + 2m
    by G.
    """

    def __init__(self, parameters, segments, links):
        """Compile the free chain; G gives each hinge the rate of the coordinate that turns it."""
        self.segments, self.links = segments, links
        self.nq, self.nv = 7 + 2 * segments, 6 + 2 * segments
        self.model = _build(parameters, segments * links).compile()
        self.data = mujoco.MjData(self.model)
        self.torso = self.model.body("torso").id
        self.G = np.eye(self.model.nv, self.nv)
        ratios = np.resize(
            np.repeat(parameters.get("joint_ratios", 1), 2), (2 * segments * links, 1)
        )
        self.G[6:, 6:] = ratios * np.kron(np.kron(np.eye(segments), np.ones((links, 1))), np.eye(2))

    def mass_matrix(self, q):
        """H = G^T M G."""
        self._evaluate(q)
        full_mass = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, full_mass)
        return self.G.T @ full_mass @ self.G

    def bias_force(self, q, v):
        """C = G^T qfrc_bias, gravity included."""
        self._evaluate(q, v)
        return self.G.T @ self.data.qfrc_bias

    def inverse_dynamics(self, q, v, v_dot):
        """H v_dot + C by MuJoCo's recursive Newton-Euler."""
        self._evaluate(q, v)
        self.data.qacc[:] = self.G @ v_dot
        full_force = np.zeros(self.model.nv)
        mujoco.mj_rne(self.model, self.data, 1, full_force)
        return self.G.T @ full_force

    def forward_dynamics(self, q, v, tau):
        """v_dot of H v_dot + C = [0; tau]."""
        force = np.concatenate([np.zeros(6), tau]) - self.bias_force(q, v)
        return cho_solve(cho_factor(self.mass_matrix(q)), force)

    def energy(self, q, v):
        """(kinetic, potential), the potential sum m g z."""
        self._evaluate(q, v)
        mujoco.mj_energyPos(self.model, self.data)
        mujoco.mj_energyVel(self.model, self.data)
        potential, kinetic = self.data.energy
        return float(kinetic), float(potential)

    def momentum(self, q, v):
        """(linear, angular about the COM), in world axes."""
        _, velocity, _ = self.center_of_mass(q, v)
        linear = self.model.body_subtreemass[self.torso] * velocity
        return linear, self.data.subtree_angmom[self.torso].copy()

    def center_of_mass(self, q, v):
        """(position, velocity, J) of the centre of mass, in world axes."""
        self._evaluate(q, v)
        mujoco.mj_subtreeVel(self.model, self.data)
        jacobian = np.zeros((3, self.model.nv))
        mujoco.mj_jacSubtreeCom(self.model, self.data, jacobian, self.torso)
        position, velocity = (
            x[self.torso].copy() for x in (self.data.subtree_com, self.data.subtree_linvel)
        )
        return position, velocity, jacobian @ self.G

    def tail_points(self, q):
        """World positions (N+1, 3) of the N joints and the tip."""
        self._evaluate(q)
        return self.data.site_xpos.copy()

    def tail_point_jacobians(self, q):
        """J (N+1, 3, nv) of the tail points, world axes: d(point)/dt = J v."""
        self._evaluate(q)
        jacobians = np.zeros((self.model.nsite, 3, self.model.nv))
        for site, jacobian in enumerate(jacobians):
            mujoco.mj_jacSite(self.model, self.data, jacobian, None, site)
        return jacobians @ self.G

    def _evaluate(self, q, v=None):
        """Compute all of MuJoCo's quantities that depend on position and velocity."""
        self.data.qpos[:3], self.data.qpos[3:7] = q[:3], q[3:7] / np.linalg.norm(q[3:7])
        self.data.qpos[7:] = self.G[6:, 6:] @ q[7:]
        self.data.qvel[:] = 0.0 if v is None else self.G @ v
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)


def _build(parameters, count):
    """MuJoCo's description of the torso and `count` links, a site on every joint and on the tip."""
    spec = _bare_spec(parameters["gravity"])
    body = spec.worldbody.add_body(name="torso")  # its COM at B
    body.add_freejoint(align=mujoco.mjtAlignFree.mjALIGNFREE_FALSE)
    _set_inertia(body, parameters["torso_mass"], (0.0, 0.0, 0.0), parameters["torso_inertia"])
    origin = parameters["tail_mount"]
    for _ in range(count):
        body = body.add_body(pos=origin)
        for axis in ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)):
            body.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis, limited=False)
        body.add_site(pos=(0.0, 0.0, 0.0))
        _add_link_mass(body, parameters, count)
        origin = (0.0, -parameters["tail_length"] / count, 0.0)
    body.add_site(pos=origin)
    return spec


def _bare_spec(gravity):
    """A description in radians whose compiler leaves the given masses, inertias and frames
    alone.
    """
    spec = mujoco.MjSpec()
    spec.option.gravity = (0.0, 0.0, -gravity)
    bits = mujoco.mjtDisableBit
    spec.option.disableflags = bits.mjDSBL_CONSTRAINT | bits.mjDSBL_CONTACT
    compiler = spec.compiler
    compiler.degree = compiler.balanceinertia = compiler.alignfree = compiler.fusestatic = False
    compiler.boundmass = compiler.boundinertia = 0.0
    compiler.settotalmass = -1.0
    return spec


def _add_link_mass(link, parameters, count):
    """One link's mass with its COM mid-link: the given diagonal, or MuJoCo's own ellipsoid (r, L/2,
    r).
    """
    mass, half = parameters["tail_mass"] / count, parameters["tail_length"] / count / 2
    center, diagonal = (0.0, -half, 0.0), parameters.get("link_inertia")
    if diagonal is not None:
        _set_inertia(link, mass, center, diagonal)
        return
    radius, kind = parameters["link_radius"], mujoco.mjtGeom.mjGEOM_ELLIPSOID
    link.add_geom(type=kind, size=(radius, half, radius), pos=center, mass=mass)


def _set_inertia(body, mass, center, diagonal):
    """An explicit inertial with the body's own axes as principal axes."""
    body.explicitinertial = True
    body.mass, body.ipos, body.inertia = mass, center, diagonal

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
        """Compile the free chain and index which reduced coordinate turns each hinge."""
        self.segments, self.links = segments, links
        self.nq, self.nv = 7 + 2 * segments, 6 + 2 * segments
        self.model = _build(parameters, segments * links).compile()
        self.data = mujoco.MjData(self.model)
        self.reduction = _reduction(segments, links)

    def mass_matrix(self, q):
        """H = G^T M G."""
        self._evaluate(q)
        full_mass = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, full_mass)
        return self.reduction.T @ full_mass @ self.reduction

    def bias_force(self, q, v):
        """C = G^T qfrc_bias, gravity included."""
        self._evaluate(q, v)
        return self.reduction.T @ self.data.qfrc_bias

    def inverse_dynamics(self, q, v, v_dot):
        """H v_dot + C by MuJoCo's recursive Newton-Euler."""
        self._evaluate(q, v)
        self.data.qacc[:] = self.reduction @ v_dot
        full_force = np.zeros(self.model.nv)
        mujoco.mj_rne(self.model, self.data, 1, full_force)
        return self.reduction.T @ full_force

    def forward_dynamics(self, q, v, tau, generalized_force=None):
        """v_dot of H v_dot + C = [0; tau] + generalized_force."""
        force = -self.bias_force(q, v)
        force[6:] += tau
        if generalized_force is not None:
            force += generalized_force
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
        self._evaluate(q, v)
        mujoco.mj_subtreeVel(self.model, self.data)
        torso = self.model.body("torso").id
        linear = self.model.body_subtreemass[torso] * self.data.subtree_linvel[torso]
        return linear, self.data.subtree_angmom[torso].copy()

    def center_of_mass(self, q, v):
        """(position, velocity, J) of the centre of mass, in world axes."""
        self._evaluate(q, v)
        mujoco.mj_subtreeVel(self.model, self.data)
        torso, jacobian = self.model.body("torso").id, np.zeros((3, self.model.nv))
        mujoco.mj_jacSubtreeCom(self.model, self.data, jacobian, torso)
        position, velocity = self.data.subtree_com[torso], self.data.subtree_linvel[torso]
        return position.copy(), velocity.copy(), jacobian @ self.reduction

    def tail_points(self, q):
        """World positions (N+1, 3) of the N joints and the tip."""
        self._evaluate(q)
        return self.data.site_xpos.copy()

    def tail_point_jacobians(self, q):
        """J (N+1, 3, nv) of the tail points, world axes: d(point)/dt = J v."""
        self._evaluate(q)
        return np.array(
            [self._full_jacobian(site) @ self.reduction for site in range(self.model.nsite)]
        )

    def _full_jacobian(self, site):
        """Linear rows of one point's Jacobian on the free chain, world axes."""
        jacobian = np.zeros((3, self.model.nv))
        mujoco.mj_jacSite(self.model, self.data, jacobian, None, site)
        return jacobian

    def _evaluate(self, q, v=None):
        """Compute all of MuJoCo's quantities that depend on position and velocity."""
        angles = np.reshape(q[7:], (self.segments, 2))
        self.data.qpos[:3], self.data.qpos[3:7] = q[:3], q[3:7] / np.linalg.norm(q[3:7])
        self.data.qpos[7:] = np.repeat(angles, self.links, axis=0).ravel()
        self.data.qvel[:] = 0.0 if v is None else self.reduction @ v
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)


def _reduction(segments, links):
    """G (6 + 2mn, 6 + 2m): hinge 2j + k is turned by coordinate 2 (j // n) + k."""
    reduction = np.zeros((6 + 2 * segments * links, 6 + 2 * segments))
    reduction[:6, :6] = np.eye(6)
    for link in range(segments * links):
        for axis in range(2):
            reduction[6 + 2 * link + axis, 6 + 2 * (link // links) + axis] = 1.0
    return reduction


def _build(parameters, count):
    """MuJoCo's description of the torso and `count` links, a site on every joint and on the tip."""
    spec = _bare_spec(parameters["gravity"])
    body = _add_torso(spec, parameters)
    length, origin = parameters["tail_length"] / count, parameters["tail_mount"]
    for _ in range(count):
        body = _add_link(body, origin, parameters, count)
        origin = (0.0, -length, 0.0)
    body.add_site(pos=origin)
    return spec


def _bare_spec(gravity):
    """A description in radians whose compiler leaves the given masses, inertias and frames
    alone.
    """
    spec = mujoco.MjSpec()
    spec.option.gravity = (0.0, 0.0, -gravity)
    spec.option.disableflags = (
        mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_CONTACT
    )
    compiler = spec.compiler
    compiler.degree = compiler.balanceinertia = compiler.alignfree = compiler.fusestatic = False
    compiler.boundmass = compiler.boundinertia = 0.0
    compiler.settotalmass = -1.0
    return spec


def _add_torso(spec, parameters):
    """The floating torso, its COM at B."""
    torso = spec.worldbody.add_body(name="torso")
    torso.add_freejoint(align=mujoco.mjtAlignFree.mjALIGNFREE_FALSE)
    _set_inertia(torso, parameters["torso_mass"], (0.0, 0.0, 0.0), parameters["torso_inertia"])
    return torso


def _add_link(parent, origin, parameters, count):
    """One link turned by a hinge about x, then one about z; a site marks its joint."""
    link = parent.add_body(pos=origin)
    for axis in ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)):
        link.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis, limited=False)
    link.add_site(pos=(0.0, 0.0, 0.0))
    _add_link_mass(link, parameters, count)
    return link


def _add_link_mass(link, parameters, count):
    """One link's mass with its COM mid-link: the given diagonal, or MuJoCo's own ellipsoid (r, L/2,
    r).
    """
    mass, half = parameters["tail_mass"] / count, parameters["tail_length"] / count / 2
    diagonal = parameters.get("link_inertia")
    if diagonal is None:
        radius = parameters["link_radius"]
        size = (radius, half, radius)
        link.add_geom(
            type=mujoco.mjtGeom.mjGEOM_ELLIPSOID, size=size, pos=(0.0, -half, 0.0), mass=mass
        )
    else:
        _set_inertia(link, mass, (0.0, -half, 0.0), diagonal)


def _set_inertia(body, mass, center, diagonal):
    """An explicit inertial with the body's own axes as principal axes."""
    body.explicitinertial = True
    body.mass, body.ipos, body.inertia = mass, center, diagonal

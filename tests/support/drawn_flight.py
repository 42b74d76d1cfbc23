"""A flight to draw: its trajectory, and a stand-in for a model that gives the tail's points."""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from serpentail.basics.attitude import rotation_matrix
from serpentail.model.chains import layout_of
from serpentail.motion.trajectory import Trajectory

SEMI_AXES = np.array([0.0315, 0.0495, 0.027])
MOUNT = np.array([0, -0.0405, 0.0045])
# forward and up at the start, m/s
SPEEDS = {"up": (0.5, 2.8), "far": (2.6, 2.8), "still": (0.0, 0.0)}


@dataclass
class Drawn:
    """What drawings need of a model with links along -y; it has no generated folder."""

    segments: int
    links: int = 4
    name: str = "drawn"
    kind: str = "articulated"
    fixed: bool = False
    samples: int | None = None
    kernels: dict = field(default_factory=dict)

    def __post_init__(self):
        sizes = {"segments": self.segments, "links": self.links}
        sizes["total"] = self.segments * self.links
        self.manifest = {"dimensions": sizes, "scene": {"coordinates": "joint"}}
        self.kinds = (self.kind,) * self.segments
        self.layout = layout_of(self.manifest, self.kinds)
        self.nq = self.layout.nq
        self.parameters = {
            "torso_mass": 0.1,
            "torso_inertia": (1e-4, 1e-4, 1e-4),
            "torso_semi_axes": tuple(SEMI_AXES),
            "tail_mount": tuple(MOUNT),
            "tail_length": 0.19466,
            "tail_mass": 0.009,
            "gravity": 9.8,
        }
        self.passive_values = self.parameters

    @property
    def turns_each(self):
        return np.full(self.segments, self.links or 1)

    def tail_points(self, q):
        return tail_points(q, self.links)


def flight(speed=SPEEDS["up"], segments=2, samples=59):
    """A tumbling torso on a parabola (or at rest) with a decaying tail swing."""
    t = np.linspace(0, 0.58, samples)
    forward, up = speed
    gravity = 9.8 * (up > 0)
    position = np.stack([0 * t, forward * t, 0.06 + up * t - gravity * t**2 / 2], axis=1)
    omega = np.array([-9.0, 3.0, 2.0])
    attitude = Rotation.from_rotvec(t[:, None] * omega).as_quat()[:, [3, 0, 1, 2]]
    phase = 18 * t[:, None] + 1.5 * np.arange(2 * segments)
    tail, rate = 0.3 * np.exp(-2 * t)[:, None] * np.stack([np.cos(phase), -18 * np.sin(phase)])
    momentum = 0.109 * np.stack([0 * t, forward + 0 * t, up - gravity * t], axis=1)
    return Trajectory(
        t=t,
        q=np.hstack([position, attitude, tail]),
        v=np.hstack([momentum / 0.109, np.tile(omega, (samples, 1)), rate]),
        tau=-1e-3 * rate,
        kinetic=np.sum(momentum**2, axis=1) / 0.218 + 2e-3,
        potential=0.109 * gravity * position[:, 2],
        linear_momentum=momentum,
        angular_momentum=np.array([-6e-4, 1e-4, 1.5e-4]) + 1e-18 * np.cos(t)[:, None],
        model=Drawn(segments),
    )


def tail_points(q, links=4, length=0.19466):
    """Joints (K, m links + 1, 3) of an articulated tail: R_j = R_{j-1} Rx(alpha) Rz(beta), links
    along -y.
    """
    rotation, segments = rotation_matrix(q[:, 3:7]), (q.shape[1] - 7) // 2
    points = [q[:, :3] + rotation @ MOUNT]
    for i in range(segments):
        bend = Rotation.from_euler("XZ", q[:, 7 + 2 * i : 9 + 2 * i]).as_matrix()
        for _ in range(links):
            rotation = rotation @ bend
            points.append(points[-1] - rotation[:, :, 1] * length / (links * segments))
    return np.stack(points, axis=1)

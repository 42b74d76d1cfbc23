"""``live``: a page that shows a run while it is integrated, or a plan while it is refined.

The parts of the animal are copies of two meshes of unit size: a ball, and a rod along z.
"""

import io
from contextlib import redirect_stdout
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from serpentail_scene.layout import POSITION, QUATERNION

from ...basics.attitude import Array, rotation_matrix
from ...basics.checks import refusal
from ...basics.errors import ViewError
from ...basics.extras import needed
from ...model.chains import refuse_given
from ...model.model import Model
from ...motion.trajectory import Trajectory
from ..animal import BELLY, Animal, Poses, animal_of, poses_of

EYE = np.array([2.0, -1.0, 0.7])  # from the animal, in its lengths
POSES = 9  # of a plan, seen at once
COLOURS = {
    "back": (150, 90, 40),
    "belly": (240, 225, 205),
    "fur": (120, 70, 30),
    "eye": (30, 27, 24),
    "tail": (200, 150, 120),
    "legs": (110, 110, 120),
}
ROUND = 16  # sides of a rod
SHORTEST = 1e-9  # m, of a rod that has a direction


@dataclass(frozen=True, eq=False)
class Instances:
    """n copies of a mesh of unit size: positions (n, 3) m, quaternions (n, 4), sizes (n, 3) m."""

    positions: Array
    wxyzs: Array
    scales: Array


def instances(animal: Animal, poses: Poses) -> dict[str, Instances]:
    """Return the parts of the animal in n poses: balls of torso and head, rods of tail and legs."""
    torso = _balls(poses.torso, [(0, 0, 0)], [animal.semi_axes])
    parts = {"back": torso, "belly": torso}
    for colour in dict.fromkeys(ball.colour for ball in animal.head):
        balls = [ball for ball in animal.head if ball.colour == colour]
        places, sizes = [ball.place for ball in balls], [ball.semi_axes for ball in balls]
        parts[colour] = _balls(poses.torso, places, sizes)
    parts["tail"] = rods(poses.tail, np.array(animal.tail_radii))
    if poses.legs is not None:
        parts["legs"] = rods(poses.legs.reshape(-1, *poses.legs.shape[2:]), animal.leg_radius)
    return parts


def _balls(torso: Array, places: Any, sizes: Any) -> Instances:
    """Balls at places of the torso (k, 3) with semi-axes (k, 3), m, in each pose (n, 7)."""
    attitudes = torso[:, QUATERNION]
    at = torso[:, None, POSITION] + np.einsum("nij,kj->nki", rotation_matrix(attitudes), places)
    return Instances(
        at.reshape(-1, 3),
        np.repeat(attitudes, len(places), axis=0),
        np.tile(sizes, (len(torso), 1)),
    )


def rods(points: Array, radii: Array | float) -> Instances:
    """Return rods between following points of chains (n, k, 3), m, of one radius, or of k - 1."""
    begins, ends = points[:, :-1].reshape(-1, 3), points[:, 1:].reshape(-1, 3)
    lengths = np.linalg.norm(ends - begins, axis=1)
    x, y, z = ((ends - begins) / np.maximum(lengths, SHORTEST)[:, None]).T
    # quaternions that turn the z axis to the rods
    turns = np.stack([1 + z, -y, x, 0 * z], axis=1)
    turns[z < -1 + 1e-9] = [0, 1, 0, 0]  # half a turn about x
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    thick = np.broadcast_to(radii, (len(points), points.shape[1] - 1)).ravel()
    return Instances((begins + ends) / 2, turns, np.column_stack([thick, thick, lengths]))


def live(model: Model, *, host: str = "127.0.0.1", port: int = 8080) -> "Live":
    """Serve a page that shows runs and plans while they are made.

    Parameters
    ----------
    model : Model
        The model; a loaded one needs "tail_points".
    host : str, default "127.0.0.1"
        Address to serve at; "0.0.0.0" lets other machines see the page.
    port : int, default 8080
        Port; if it is taken, the next free one is used.

    Returns
    -------
    Live
        The view, to be passed as ``watch`` to ``simulate`` or ``plan``. Its ``url`` is the
        address of the page, ``stop()`` ends it; it is also a context manager.

    Raises
    ------
    ExtraMissing
        viser is not installed; it comes with the extra "live".
    ModelError
        The model lacks "tail_points".

    Examples
    --------
    >>> with st.live(model) as page:  # doctest: +SKIP
    ...     st.simulate(model, q0, v0, watch=page)
    """
    model.kernel("tail_points")
    refuse_given(model, "live")
    viser = needed("viser", "live")
    with redirect_stdout(io.StringIO()):  # it prints a box, whatever `verbose` says
        server = viser.ViserServer(host=host, port=port, label=model.name, verbose=False)
    return Live(model, server)


class Live:
    """A page that shows the last pose of a run, or poses of a plan; it is served until ``stop``."""

    def __init__(self, model: Model, server: Any):
        self.model, self.server, self.animal = model, server, animal_of(model)
        self.nodes: dict[str, Any] = {}
        self.meshes = _meshes()
        self.text = server.gui.add_markdown("nothing yet")
        server.scene.set_up_direction("+z")
        size = self.animal.length
        if model.contacts:
            cells = {"cell_size": size / 4, "section_size": size, "infinite_grid": True}
            server.scene.add_grid("/ground", plane="xy", **cells)

    @property
    def url(self) -> str:
        """Address for a browser."""
        return f"http://{self.server.get_host()}:{self.server.get_port()}"

    def __repr__(self) -> str:
        return f"<serpentail live view of {self.model.name} at {self.url}>"

    def __call__(self, news: Any) -> None:
        """Show the last sample of a Trajectory, or nine moments of a Plan.

        ViewError if it is not of this model.
        """
        motion = getattr(news, "trajectory", news)
        if not isinstance(motion, Trajectory) or motion.q.shape[1] != self.model.nq:
            needs = f"a Trajectory or a Plan of {self.model.name}, whose q has {self.model.nq}"
            raise refusal("news", news, needs, ViewError)
        rows, text = np.array([-1]), f"t = {motion.t[-1]:.4f} s"
        if motion is not news:
            rows = np.linspace(0, len(motion.t) - 1, POSES).round().astype(int)
            text = f"```\n{news!r}\n```"
        legs = None if motion.contact is None else motion.contact.legs
        self._show(motion.q[rows], None if legs is None else legs[rows], text)

    def _show(self, q: Array, legs: Array | None, text: str) -> None:
        """Show poses (n, nq), as one change of the scene."""
        poses = poses_of(self.model, q, legs)
        if not self.nodes:
            self._aim(poses.torso[0, POSITION])
        with self.server.atomic():
            for name, copies in instances(self.animal, poses).items():
                self._place(name, copies)
            self.text.content = text
        self.server.flush()

    def _aim(self, at: Array) -> None:
        """Point the cameras at a place (3,), m, so that the whole body is seen."""
        begin = self.server.initial_camera  # for later clients
        for camera in (begin, *(client.camera for client in self.server.get_clients().values())):
            camera.position = at + self.animal.length * EYE
            camera.look_at = at

    def _place(self, name: str, copies: Instances) -> None:
        """Move the copies of a part; make new ones if there are none, or another number."""
        node = self.nodes.get(name)
        if node is None or len(node.batched_positions) != len(copies.positions):
            self.nodes[name] = self.server.scene.add_batched_meshes_simple(
                f"/animal/{name}",
                *self.meshes[name],
                batched_wxyzs=copies.wxyzs,
                batched_positions=copies.positions,
                batched_scales=copies.scales,
                batched_colors=COLOURS[name],
                lod="off",
            )
            return
        node.batched_positions = copies.positions
        node.batched_wxyzs = copies.wxyzs
        node.batched_scales = copies.scales

    def stop(self) -> None:
        """Stop serving the page."""
        with redirect_stdout(io.StringIO()):
            self.server.stop()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


def _meshes() -> dict[str, tuple[Array, Array]]:
    """Vertices and faces of each part's mesh: back and belly are the two sides of one ball."""
    solids = needed("trimesh", "live").creation
    ball, rod = (
        (np.asarray(mesh.vertices), np.asarray(mesh.faces))
        for mesh in (solids.uv_sphere(), solids.cylinder(1.0, 1.0, sections=ROUND))
    )
    vertices, faces = ball
    above = vertices[faces, 2].mean(axis=1) > np.mean(BELLY)  # whole rings of faces
    sides = {"back": (vertices, faces[above]), "belly": (vertices, faces[~above])}
    return sides | {"fur": ball, "eye": ball, "tail": rod, "legs": rod}

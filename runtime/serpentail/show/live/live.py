"""``live``: a page that shows a run while it is integrated, or a plan while it is refined."""

import io
from contextlib import redirect_stdout
from typing import Any, Self

import numpy as np

from serpentail_scene.layout import POSITION

from ...basics.attitude import Array, pose_of
from ...basics.checks import refusal
from ...basics.errors import ViewError
from ...basics.extras import needed
from ...model.model import Model
from ...motion.trajectory import Trajectory
from ..page.shape import length
from .poses import Instances, animal

EYE = np.array([2.0, -1.0, 0.7])  # from the animal, in its lengths
POSES = 9  # of a plan, seen at once
COLOURS = {
    "back": (150, 90, 40),
    "belly": (240, 225, 205),
    "head": (120, 70, 30),
    "tail": (200, 150, 120),
    "legs": (110, 110, 120),
}
ROUND = 16  # sides of a rod


def live(model: Model, *, host: str = "127.0.0.1", port: int = 8080) -> "Live":
    """Serve a page that shows runs and plans while they are made.

    Parameters
    ----------
    model : Model
        The model; it needs "tail_points".
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
    viser = needed("viser", "live")
    with redirect_stdout(io.StringIO()):  # it prints a box, whatever `verbose` says
        server = viser.ViserServer(host=host, port=port, label=model.name, verbose=False)
    return Live(model, server)


class Live:
    """A page that shows the last pose of a run, or poses of a plan; it is served until ``stop``."""

    def __init__(self, model: Model, server: Any):
        self.model, self.server = model, server
        self.nodes: dict[str, Any] = {}
        solids = needed("trimesh", "live").creation
        ball, rod = solids.icosphere(subdivisions=3), solids.cylinder(1.0, 1.0, sections=ROUND)
        self.meshes = dict.fromkeys(("tail", "legs"), rod)
        self.meshes |= dict.fromkeys(("back", "belly", "head"), ball)
        self.text = server.gui.add_markdown("nothing yet")
        server.scene.set_up_direction("+z")
        size = length(model)
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
        if not self.nodes:
            self._aim(pose_of(q, self.model.layout)[0, POSITION])
        with self.server.atomic():
            for name, instances in animal(self.model, q, legs).items():
                self._place(name, instances)
            self.text.content = text
        self.server.flush()

    def _aim(self, at: Array) -> None:
        """Point the cameras at a place (3,), m, so that the whole body is seen."""
        begin = self.server.initial_camera  # for later clients
        for camera in (begin, *(client.camera for client in self.server.get_clients().values())):
            camera.position = at + length(self.model) * EYE
            camera.look_at = at

    def _place(self, name: str, instances: Instances) -> None:
        """Move the copies of a part; make new ones if there are none, or another number."""
        node, mesh = self.nodes.get(name), self.meshes[name]
        if node is None or len(node.batched_positions) != len(instances.positions):
            self.nodes[name] = self.server.scene.add_batched_meshes_simple(
                f"/animal/{name}",
                np.asarray(mesh.vertices),
                np.asarray(mesh.faces),
                batched_wxyzs=instances.wxyzs,
                batched_positions=instances.positions,
                batched_scales=instances.scales,
                batched_colors=COLOURS[name],
                lod="off",
            )
            return
        node.batched_positions = instances.positions
        node.batched_wxyzs = instances.wxyzs
        node.batched_scales = instances.scales

    def stop(self) -> None:
        """Stop serving the page."""
        with redirect_stdout(io.StringIO()):
            self.server.stop()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

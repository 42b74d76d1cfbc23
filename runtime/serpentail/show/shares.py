"""``momentum_shares``: who turned the body, told apart by angular momentum."""

import os
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from serpentail_scene.layout import OMEGA, POSITION, VELOCITY
from serpentail_scene.parameters import name_in

from ..basics.attitude import Array
from ..basics.checks import needed
from ..basics.errors import UnusualSize
from ..basics.near_names import NearNames
from ..model.chains import refuse_given
from ..model.model import Model
from ..model.parameters import independent
from ..model.weight import total_mass
from ..motion.text import as_text
from ..motion.trajectory import Trajectory

if TYPE_CHECKING:
    from .pictures.plot import Figure

MASSES = ("tail_mass", "link_masses", "arc_masses", "link_inertia", "link_inertias")
TORSO, TAIL, SPIN, OUTSIDE, SUM = "torso", "tail", "spin", "outside", "sum"
AXES = ("pitch", "roll", "yaw")


@dataclass(frozen=True, eq=False)
class MomentumShares(NearNames):
    """Who turned the torso, and who has the angular momentum, at the K times of a motion.

    Printed, it tells the turns of the whole motion in degrees. What happened from one time to
    another is the difference of the turns at both.

    Attributes
    ----------
    motion : Trajectory
        The motion, with its times ``motion.t`` (s).
    turns : dict of str to ndarray, shape (K, 3)
        What turned the torso since the first sample (rad), about its own axes x (pitch), y (roll)
        and z (yaw): "spin", the angular momentum at the start, as if all joints stayed as they are;
        "tail" and each other chain, by its motion; "outside", the angular impulse of the ground or
        of what else acts on the animal. Pairs of legs are one chain.
    turned : ndarray, shape (K, 3)
        The sum of these: the integral of the torso's angular velocity (rad).
    momentum : dict of str to ndarray, shape (K, 3)
        Angular momentum (kg m^2/s, world) of "torso", "tail" and each other chain about the centre
        of mass of the animal. Their sum is the animal's.
    """

    motion: Trajectory
    turns: dict[str, Array]
    turned: Array
    momentum: dict[str, Array]

    def __str__(self) -> str:
        whole = {name: np.degrees(x[-1]) for name, x in (self.turns | {SUM: self.turned}).items()}
        rows = {name: "".join(f"{x:9.2f}" for x in turn) for name, turn in whole.items()}
        heads = {"": "".join(f"{axis:>9}" for axis in AXES)}
        return as_text(heads | rows, dict.fromkeys(rows, "deg"))

    def plot(self, path: str | os.PathLike[str] | None = None) -> tuple["Figure", Any]:
        """Draw the turns over time; return Matplotlib's figure and its axes.

        path: also write the figure to this .pdf, .png or .svg file. ViewError for another suffix,
        ExtraMissing without the extra "plot".
        """
        from .pictures.results import shares_figure

        return shares_figure(self, path)


def momentum_shares(model: Model, motion: Any) -> MomentumShares:
    """Tell who turned the body: its spin, the tail, the legs, or something outside.

    Parameters
    ----------
    model : Model
        The model that moved, with a free base. Its parameters are not baked.
    motion : Trajectory, or what has one
        The motion; also a plan, ``st.joint_torques`` of marker tracks, or a trial of an
        identification.

    Returns
    -------
    MomentumShares
        Turns of the torso by cause, and the angular momentum of each part.

    Raises
    ------
    ModelError
        The base is fixed, or the parameters are baked into the code.
    StateError
        The motion is one of another model.
    ValueError
        ``motion`` has no trajectory.

    Notes
    -----
    The angular momentum about the centre of mass is h = A omega + sum of B_c q_dot_c over the
    chains c, with the inertia A of the animal in its present shape. So omega = A^-1 h(0) + A^-1 (h
    - h(0)) - sum of A^-1 B_c q_dot_c: spin, outside, chains. Each is integrated by the trapezoidal
    rule over the samples, so the shares add up to rounding; give samples that follow the motion.
    In flight "outside" is zero but for the errors of the motion.
    """
    model.refuse_fixed("momentum_shares")
    refuse_given(model, "momentum_shares")
    motion = getattr(motion, "trajectory", motion)
    if not isinstance(motion, Trajectory):
        raise ValueError(needed("motion", motion, "a Trajectory, a Plan or JointTorques"))
    q, v = np.array(motion.q), np.array(motion.v)
    q[:, POSITION] = v[:, VELOCITY] = 0.0  # which change nothing about the centre of mass
    chains: dict[str, list[int]] = {}
    for chain in model.layout.chains:
        chains.setdefault(chain.owner or TAIL, []).extend(range(model.nv)[chain.v])

    def h_of(columns: list[int], rates: Array | float) -> Array:
        """Angular momentum (K, 3) if only these columns of v move."""
        moving = np.zeros_like(v)
        moving[:, columns] = rates
        return model.momentum(q, moving)[1].astype(float)

    # rates of the torso by cause
    torso = list(range(model.nv))[OMEGA]
    A = np.stack([h_of([k], 1.0) for k in torso], axis=-1)
    by = {name: h_of(columns, v[:, columns]) for name, columns in chains.items()}
    h = h_of(torso, v[:, OMEGA]) + sum(by.values())
    causes = {SPIN: np.broadcast_to(h[0], h.shape)} | {name: -x for name, x in by.items()}
    causes[OUTSIDE] = h - h[0]
    rates = {name: np.linalg.solve(A, each[..., None])[..., 0] for name, each in causes.items()}
    rates[SUM] = v[:, OMEGA]
    turns = {
        name: np.asarray(cumulative_trapezoid(rate, motion.t, axis=0, initial=0.0))
        for name, rate in rates.items()
    }

    parts = {name: _part(model, name, q, v) for name in chains}
    momentum = {TORSO: h - sum(parts.values())} | parts
    return MomentumShares(motion, turns, turns.pop(SUM), momentum)


def _part(model: Model, chain: str, q: Array, v: Array) -> Array:
    """Angular momentum (K, 3) of a chain about the moving centre of mass: what its doubled masses
    add to the sums over all.
    """
    names = [name_in("" if chain == TAIL else chain, name) for name in MASSES]
    own = independent(model.manifest, model.parameters)
    masses = {name: 2 * np.array(own[name]) for name in names if name in own}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnusualSize)
        double = model.with_parameters(**masses)

    def sums(of: Model) -> list[Array]:
        """Mass, first moment, momentum and angular momentum about B."""
        M, c, (p, h) = total_mass(of.parameters), of.center_of_mass(q, v)[0], of.momentum(q, v)
        return [M, M * c, p, h + np.cross(c, p)]

    M, first, p, _ = whole = sums(model)
    m, own_first, own_p, own_L = (b - a for a, b in zip(whole, sums(double), strict=True))
    c, c_dot = first / M, p / M
    return own_L - np.cross(c, own_p) - np.cross(own_first - m * c, c_dot)

"""What a motion is asked for: its states at any time, numbers by name, and its summary."""

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..basics.attitude import Array
from ..basics.checks import measured
from ..model.model import Model
from ..model.names import Names
from ..model.state import State, named
from .archive import NAMES
from .derived import AGAIN
from .given import LOADS, tensions_at
from .mount import mount_wrenches
from .resample import inside, states_between
from .validation import layout_of, real

if TYPE_CHECKING:
    from .summary import Summary


class Asked:
    """Answers of a trajectory. ``len(motion)`` is its number of samples."""

    t: Array
    q: Array
    v: Array
    tau: Array
    contact: Any
    info: dict[str, Any]
    model: Model | None

    @property
    def names(self) -> Names:
        """Name and unit of each number of q, v and tau."""
        own = self.model.layout.names if self.model else self.info.get(NAMES, ())
        return Names.of(layout_of(self.q, self.v), own)

    def __len__(self) -> int:
        return len(self.t)

    def __getitem__(self, name: str) -> Array:
        """Return the samples (K,) of a number of q, v or tau, such as ``motion["alpha_1"]``.

        The names are those of ``Model.coordinates``, ``velocities`` and ``torques``. KeyError
        suggests the nearest one.
        """
        return named(self, self.names, name, self.names.all())

    @property
    def end(self) -> State:
        """The state at the last sample."""
        return State(self.q[-1], self.v[-1], self.names)

    def at(self, t: ArrayLike | str) -> State:
        """Return the state at any time, or the states at many.

        Parameters
        ----------
        t : float, str or array_like, shape (n,)
            Times (s) within those of the motion, in any order.

        Returns
        -------
        State
            The state; of n times q (n, nq) and v (n, nv).

        Raises
        ------
        ValueError
            A time is outside; the message names the first one.

        Notes
        -----
        What ``simulate`` or a sequence made is made again, with samples at these times: they come
        from the same steps, by the polynomial of the method, and steps of a fixed length are cut
        there. This takes as long as the motion did: ask for many times at once. Motions of
        another origin (read, planned, of ``Rollouts``, or controlled by ``Sampled``) are
        interpolated as by ``resample``.
        """
        given = real("t", measured("t", t, "s", ValueError))
        times = inside(np.atleast_1d(given), self.t)
        again = vars(self).get(AGAIN)
        q, v = again.at(times) if again is not None else states_between(self, times)
        return State(q, v, self.names) if given.ndim else State(q[0], v[0], self.names)

    @property
    def mount_wrench(self) -> tuple[Array, Array]:
        """Force (K, 3), N, and moment (K, 3), N m, of the tail on the torso, torso axes.

        They act at the tail's mount, at every sample, and are computed when asked for. The model
        needs ``mount_wrench``, and on the ground ``forward_dynamics_external``. ValueError is
        raised if the motion has no model, or was simulated with a load.
        """
        if self.model is None:
            raise ValueError("mount_wrench: this motion has no model: use model.mount_wrench")
        if LOADS in self.info:
            raise ValueError("mount_wrench: not known under a load: use model.mount_wrench")
        return mount_wrenches(self.model, self)

    @property
    def tensions(self) -> Array:
        """Tensions (K, tendons) of the tendons, N, in a run by a table or curve of tensions;
        ``Plan.tension`` has those of a plan. ValueError is raised for other motions.
        """
        found = tensions_at(self.info, self.t)
        if found is None:
            raise ValueError("tensions: this motion was not simulated with tensions: use tau")
        return found

    def vjp(
        self,
        q: ArrayLike | None = None,
        v: ArrayLike | None = None,
        bristles: ArrayLike | None = None,
    ) -> Any:
        """Return the gradient of a weighted sum of the end of a run by all that it was made of.

        Parameters
        ----------
        q, v : array_like, shape (nv,), optional
            Weights of the last q, in its tangent space, and of the last v; default zeros.
        bristles : array_like, shape (K, 2), optional
            Weights of the friction springs at the end; default zeros.

        Returns
        -------
        Gradient
            By start, parameters, damping, torques and legs. ``exists`` and ``doubts`` tell if it
            is a derivative.

        Raises
        ------
        SimulationError
            An argument is wrong; the run has no derivatives, because of its method (only "tsit5",
            "ros34pw2" and "switching" have), its controller (only Damping, TorqueTable and
            TorqueCurve have), an event at which it stopped, or its model.
        ValueError
            The motion is not from ``simulate`` with one start.

        Notes
        -----
        The first call makes the run again with a tape, at a 20th of its tolerance. Steps are
        differentiated with J of implicit methods held, on a grid that moves with every touch and
        with every other kink of the forces. A model that lacks the C for this gets it: that takes
        as long as compiling the model.
        """
        return self._run("vjp").vjp(q, v, bristles)

    def jvp(
        self,
        q0: ArrayLike | None = None,
        v0: ArrayLike | None = None,
        bristles0: ArrayLike | None = None,
        parameters: Mapping[str, ArrayLike] | None = None,
        schedules: Iterable[tuple[Callable[[Array], Any], ArrayLike, ArrayLike]] = (),
    ) -> Any:
        """Return how the end of a run changes with all that it was made of; errors as of ``vjp``.

        Parameters
        ----------
        q0, v0 : array_like, shape (nv,), optional
            Change of q0, in its tangent space, and of v0, SI; default zeros.
        bristles0 : array_like, shape (K, 2), optional
            Change of the friction springs at the start (m); default zeros.
        parameters : mapping, optional
            Changes of named parameters (SI), as by ``Model.with_parameters``.
        schedules : sequence of (callable, x, dx), optional
            Functions that make the run's legs or controller of numbers, as for ``Gradient.by``; the
            numbers of the run (n,), and their changes (n,).

        Returns
        -------
        Change
            Change of the end, to first order. It agrees with ``vjp`` to rounding.
        """
        return self._run("jvp").jvp((q0, v0, bristles0), parameters or {}, schedules)

    def _run(self, field: str) -> Any:
        """Return what makes the run again; ValueError if it has no derivatives."""
        again: Any = vars(self).get(AGAIN)
        if not hasattr(again, "vjp"):
            raise ValueError(f"{field}: only motions of simulate, from one start, have derivatives")
        return again

    def summary(self, errors: bool = False) -> "Summary":
        """Return the numbers of the motion by name, such as apex, landing, forces and work.

        Arguments, result and errors are those of ``serpentail.summary``. ValueError is raised if
        the motion has no model.
        """
        from .summary import summary

        if self.model is None:
            raise ValueError("summary: this motion has no model: use st.summary(model, motion)")
        return summary(self.model, self, errors)  # type: ignore[arg-type]

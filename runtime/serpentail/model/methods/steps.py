"""Methods of a model that advance states by steps of a fixed length."""

from typing import TYPE_CHECKING, Any, cast

from numpy.typing import ArrayLike

from ..lazy import kept
from .evaluated import Array, Evaluated

if TYPE_CHECKING:
    from ..model import Model
    from ..stepping.step import Stepping


class StepMethods(Evaluated):
    """Methods that advance states by steps of a fixed length."""

    def step(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike, h: float, **settings: Any
    ) -> tuple[Array, ...]:
        """Advance one state, or k states at once, under constant torques.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,), or (k, nq) and (k, nv)
            States at the start.
        tau : array_like, shape (2m,) or (k, 2m)
            Torques (N m), constant during the call; of all runs or of each.
        h : float
            Length of a step (s).
        steps : int, default 1
            Number of steps in this call, at most 10,000.
        out : sequence of ndarray, optional
            Arrays for the results; they may be ``q`` and ``v`` themselves. Then nothing is
            allocated.
        parameters : mapping or RunParameters, optional
            Parameters of each run: name to values (k,) or (k, 3), or what ``parameters_of_runs``
            returned.
        bristles : array_like, shape (2K,) or (k, 2K)
            Stretch (m) of the friction springs of the K points; only with contacts, required there.
        legs : array_like, shape (8,) or (k, 8)
            Leg angles (rad) and rates (rad/s) as in ``contact_dynamics``; only with feet, required
            there. Within the call the angles advance at these rates.
        method : {"rk4", "implicit_euler"}, optional
            Default: "rk4" in flight, "implicit_euler" with contacts.
        threads : int, optional
            Largest number of threads; default: the model's, see ``load``.
        statuses : ndarray of numpy.intc, shape (k,), optional
            Receives the status of each run, 0 for success. With it no failing run raises an error.

        Returns
        -------
        q, v : ndarray
            States after the steps, of the shapes of the arguments.
        bristles : ndarray
            Stretch of the friction springs (m); only with contacts.

        Raises
        ------
        StateError
            A shape or a value is wrong.
        SimulationError
            ``h`` or another setting is wrong, or a run cannot go on: it keeps its last valid state,
            and the other runs are advanced.
        ModelError
            The scene left out "rollout" or, with contacts, "implicit".

        Notes
        -----
        Eight or more runs are computed in SIMD lanes, in flight by "rk4", with contacts by
        "implicit_euler". The C of these is compiled in the first such call.
        """
        from ..stepping.step import step

        return step(cast("Model", self), (q, v, tau), h, settings)

    @kept
    def stepping(self) -> "Stepping":
        """What ``step`` keeps between calls."""
        from ..stepping.step import Stepping

        return Stepping(cast("Model", self))

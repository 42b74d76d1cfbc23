"""The end of a run and its gradient as functions of arrays of numbers, which tools call."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from serpentail_scene.layout import QUATERNION

from ...model.model import Model
from ...model.state_space import in_numbers, in_tangent
from ...motion.trajectory import Trajectory
from ...simulation.simulate import simulate

Arrays = tuple[np.ndarray, ...]


@dataclass(frozen=True, eq=False)
class DifferentiableRun:
    """A run of arrays: q0, v0, and what enters by these ways: a parameter, or numbers of which a
    function makes a setting. nan: whether gradients are nan where there is none.
    """

    model: Model
    t_span: Any
    ways: Mapping[str, Callable[[np.ndarray], Any] | None]
    settings: Mapping[str, Any]
    nan: bool

    def end(self, *arrays: Any) -> Arrays:
        """Return q (nq,) and v (nv,) at the end."""
        run = self._made(arrays)
        return run.q[-1], run.v[-1]

    def gradient(self, by_q: Any, by_v: Any, *arrays: Any) -> Arrays:
        """Return the gradient by each array of a sum of q and v at the end with these weights."""
        run, (q0, _, *others) = self._made(arrays), map(np.asarray, arrays)
        by = run.vjp(in_tangent(run.q[-1], np.asarray(by_q), 0.5), by_v)

        # nothing changes along a quaternion, of any norm
        found = [in_numbers(q0, by.q0, 2 / (q0[QUATERNION] ** 2).sum()), by.v0]
        ways = zip(self.ways.items(), others, strict=True)
        found += [by.by(make or name, x) for (name, make), x in ways]
        scale = 1.0 if by.exists or not self.nan else np.nan
        return tuple(scale * x.reshape(np.shape(y)) for x, y in zip(found, arrays, strict=True))

    def _made(self, arrays: Arrays) -> Trajectory:
        q0, v0, *others = map(np.asarray, arrays)
        own, settings = {}, dict(self.settings)
        for (name, way), x in zip(self.ways.items(), others, strict=True):
            if way is None:
                own[name] = x.tolist()
            else:
                settings[name] = way(x)
        return simulate(self.model.with_parameters(**own), q0, v0, self.t_span, **settings)

"""The end of a run and its gradient as functions of arrays of numbers, which tools call."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from serpentail_scene.layout import QUATERNION

from ...model.model import Model
from ...model.state_space import in_numbers, in_tangent
from ...simulation.one_run import RunAgain
from ...simulation.simulate import run_of, simulate

Arrays = tuple[np.ndarray, ...]


@dataclass(frozen=True, eq=False)
class DifferentiableRun:
    """A run of arrays: q0, v0, parameters by their names, and numbers of which settings are made.

    nan: whether gradients are nan where there is none, or those of one side.
    """

    model: Model
    t_span: Any
    names: tuple[str, ...]
    makers: Mapping[str, Callable[[np.ndarray], Any]]
    settings: Mapping[str, Any]
    nan: bool

    def end(self, *arrays: Any) -> Arrays:
        """Return q (nq,) and v (nv,) at the end."""
        motion = self._made(simulate, arrays)
        return motion.q[-1], motion.v[-1]

    def gradient(self, by_q: Any, by_v: Any, *arrays: Any) -> Arrays:
        """Return the gradient by each array of a sum of q and v at the end with these weights."""
        run: RunAgain = self._made(run_of, arrays)
        q0 = np.asarray(arrays[0])
        by = run.vjp(in_tangent(run.tape.end[0], np.asarray(by_q), 0.5), by_v, None)

        # nothing changes along a quaternion, of any norm
        found = [in_numbers(q0, by.q0, 2 / (q0[QUATERNION] ** 2).sum()), by.v0]
        found += [by.by(name) for name in self.names]
        made = zip(self.makers.values(), arrays[2 + len(self.names) :], strict=True)
        found += [by.by(make, np.asarray(x)) for make, x in made]
        scale = 1.0 if by.exists or not self.nan else np.nan
        return tuple(scale * x.reshape(np.shape(y)) for x, y in zip(found, arrays, strict=True))

    def _made(self, make: Callable[..., Any], arrays: Arrays) -> Any:
        q0, v0, *others = map(np.asarray, arrays)
        own = {name: x.tolist() for name, x in zip(self.names, others, strict=False)}
        made = zip(self.makers.items(), others[len(own) :], strict=True)
        settings = dict(self.settings) | {name: each(x) for (name, each), x in made}
        return make(self.model.with_parameters(**own), q0, v0, self.t_span, **settings)

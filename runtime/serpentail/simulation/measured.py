"""Measures: samples of a run go in; its trajectory, or the error that ended it, comes out."""

from ..errors import SimulationError, StateError
from ..motion.trajectory import Trajectory
from .compiled_run import Samples
from .ground import Ground


def trajectory_or_error(model, found: Samples, ground: Ground) -> Trajectory:
    """Return the trajectory of samples, or raise what ended the run, which keeps the trajectory up
    to there.
    """
    if not len(found.t):
        raise found.failure
    try:
        trajectory = measured(model, found, ground)
    except StateError as error:
        words = f"from t = {found.t[0]:.6g} s to {found.t[-1]:.6g} s, by sample: {error}"
        raise found.failure or SimulationError(words) from (None if found.failure else error)
    if found.failure is None:
        return trajectory
    if isinstance(found.failure, SimulationError):
        found.failure.trajectory = trajectory
    raise found.failure


def measured(model, found: Samples, ground: Ground) -> Trajectory:
    """Return samples with energies, momenta and forces; StateError where these are beyond
    numbers.
    """
    info = found.info | {"model": model.name}
    info["parameters"] = {
        name: list(x) if isinstance(x, tuple) else x for name, x in model.parameters.items()
    }
    measures = *model.energy(found.q, found.v), *model.momentum(found.q, found.v)
    contact = ground.contact(model, found.t, (found.q, found.v, found.tau, found.bristles))
    return Trajectory(found.t, found.q, found.v, found.tau, *measures, info, contact)

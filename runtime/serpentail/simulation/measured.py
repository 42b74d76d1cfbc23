"""Makes a trajectory of the samples of a run, or raises the error that ended the run."""

import numpy as np

from ..errors import SimulationError, StateError
from ..model.model import Model
from ..motion.origin import origin
from ..motion.trajectory import Trajectory
from .audit import BALANCED, audited, warnings_of
from .compiled_run import Samples
from .ground import Ground


def trajectory_or_error(model: Model, samples: Samples, ground: Ground) -> Trajectory:
    """Return the trajectory of samples, or raise what ended the run; that keeps the trajectory."""
    t, failure = samples.t, samples.failure
    if failure is not None and not len(t):
        raise failure
    try:
        trajectory = measured(model, samples, ground)
    except StateError as error:
        if failure is not None:
            raise failure from None
        words = f"from t = {t[0]:.6g} s to {t[-1]:.6g} s, by sample: {error}"
        raise SimulationError(words) from error
    if failure is None:
        return trajectory
    if isinstance(failure, SimulationError):
        failure.trajectory = trajectory
    if isinstance(failure, KeyboardInterrupt):
        vars(failure)["motion"] = trajectory
    raise failure


def measured(model: Model, samples: Samples, ground: Ground) -> Trajectory:
    """Return samples with energies, momenta and forces; StateError where no number holds these."""
    t, q, v, tau = samples.t, samples.q, samples.v, samples.tau
    info = samples.info | origin(model)
    if samples.failure is not None:
        info["failure"] = str(samples.failure)
    kinetic, potential = model.energy(q, v)
    linear_momentum, angular_momentum = model.momentum(q, v)
    contact = ground.contact(model, t, (q, v, tau, samples.bristles))
    if samples.failure is None and samples.ledger.size:  # a part of a run has no ledger
        measures = kinetic, potential, linear_momentum
        ends = {name: each[[0, -1]] for name, each in zip(BALANCED, measures, strict=True)}
        books = audited(model, model.parameters, samples.ledger, t[-1] - t[0], ends)
        eps = float(np.finfo(model.parameter_vector.dtype).eps)
        info |= books.info() | {"warnings": warnings_of(books, info, eps)}
    return Trajectory(
        t=t,
        q=q,
        v=v,
        tau=tau,
        kinetic=kinetic,
        potential=potential,
        linear_momentum=linear_momentum,
        angular_momentum=angular_momentum,
        info=info,
        contact=contact,
        model=model,
    )

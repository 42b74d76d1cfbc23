"""Laws of tendons: how their lengths change, and what their tensions do."""

import numpy as np

from ..model.model import Model
from .errors import relative
from .law import SLOPE_LIMIT, VALUE_LIMIT, Errors, fastest, law, slope
from .states import Case


@law("tendon_lengths", SLOPE_LIMIT, only="tendons")
def lengths_change_with_the_tail(model: Model, s: Case) -> Errors:
    """The rate of a length along a motion is B q_t_dot."""
    tail, rates = model.layout.tail_q, s.v[model.layout.tail_v]

    def lengths(t: float) -> np.ndarray:
        q = s.q.copy()
        q[tail] += t * rates
        return model.tendon_lengths(q)[0].astype(float)

    rate = max(1.0, fastest(model, s.v))
    change, largest = slope(lengths, rate)
    return relative(change, model.tendon_lengths(s.q)[1] @ rates, largest * rate)


@law("tendon_lengths tendon_torques", VALUE_LIMIT, only="tendons")
def tensions_have_the_power_of_their_tendons(model: Model, s: Case) -> Errors:
    """T l_dot + tau q_t_dot = 0: what tendons lose, the tail gains."""
    B, rates = model.tendon_lengths(s.q)[1].astype(float), s.v[model.layout.tail_v]
    given = s.tension * (B @ rates)
    taken = model.tendon_torques(s.q, s.tension) @ rates
    return relative(given.sum(), -taken, np.abs(given).sum())

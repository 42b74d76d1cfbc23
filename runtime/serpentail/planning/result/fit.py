"""What refuses a model to fly a plan by feedback."""

from collections.abc import Iterable

from ...basics.errors import PlanningError
from ...model.model import Model
from ..air import refuse_air
from ..tendons import refuse_tendons
from .plan import Plan


def refuse_unfit(name: str, model: Model, plan: Plan, functions: Iterable[str]) -> None:
    """ModelError or PlanningError if a model cannot fly a plan by a controller of this name."""
    model.refuse_fixed(name)
    refuse_air(model, name)
    refuse_tendons(model, name)
    if "airspeed" in plan.curve.starts:
        raise PlanningError(f"{name}: the plan was made in air: give one of a model without air")
    model.need(*functions)
    if model.library is None:
        raise PlanningError(
            f"{name}: the model was loaded with compiled=False: load it again with C"
        )
    tail = plan.curve.starts["tail"].shape[1]
    if tail != model.layout.nt:
        raise PlanningError(
            f"{name}: the plan has {tail} tail coordinates, the model {model.layout.nt}"
        )

"""What ``simulate`` takes by name, for editors and type checkers; its docstring describes it."""

from collections.abc import Mapping, Sequence
from typing import Any, Required, TypedDict

from ..model.state import Quantities, Quantity, Span
from .callback import Watch
from .controllers.controller import Controller
from .controllers.schedules import Legs


class RunSettings(TypedDict, total=False):
    """Settings of one run and of many."""

    method: str
    output_step: Quantity
    rtol: float
    atol: float
    first_step: Quantity
    least_step: Quantity
    most_step: Quantity
    most_steps: float
    step: Quantity
    legs: Legs
    bristles0: Quantities
    stop_at: Sequence[tuple[str, str]]


class OfOne(RunSettings, total=False):
    """Those of a run from one start."""

    controller: Controller
    watch: Watch


class OfMany(RunSettings, total=False):
    """Those of runs from k starts."""

    controller: Controller | Sequence[Controller]
    threads: int


class OfVaried(OfMany):
    """Those of runs with parameters of their own."""

    parameters: Required[Mapping[str, Quantities]]


class OfScenario(OfOne, total=False):
    """Those that a scenario's own start leaves open."""

    t_span: Span


class OfOther(OfMany, total=False):
    """Those of a scenario from another start, or from many."""

    q0: Any
    v0: Any
    t_span: Span
    parameters: Mapping[str, Quantities]

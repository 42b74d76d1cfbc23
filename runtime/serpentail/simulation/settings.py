"""What ``simulate`` takes by name, for editors and type checkers; its docstring describes it."""

from collections.abc import Mapping, Sequence
from typing import Required, TypedDict

from ..model.state import Quantities, Quantity
from .callback import Watch
from .controllers.controller import Controller
from .controllers.load import Load
from .controllers.prescribed import Prescribed
from .controllers.schedules import Legs


class RunSettings(TypedDict, total=False):
    """Settings of one run or of many."""

    controller: Controller | Sequence[Controller]
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
    prescribed: Prescribed
    load: Load | Sequence[Load]
    bristles0: Quantities
    stop_at: Sequence[tuple[str, str]]
    watch: Watch
    threads: int


class VariedRuns(RunSettings):
    """Settings of runs with parameters of their own."""

    parameters: Required[Mapping[str, Quantities]]

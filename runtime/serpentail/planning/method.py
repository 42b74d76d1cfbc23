"""How a plan is found: the settings of mesh, solver and search."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Method:
    """How to solve: rule and degree, mesh, tolerance (deg, None: no demand) of the truth, solver,
    guesses.
    """

    rule: str = "radau"
    degree: int | None = None
    intervals: int = 12
    tolerance: float | None = 0.01
    rounds: int = 6
    most_intervals: int = 200
    solver: str = "ipopt"
    options: dict = field(default_factory=dict)
    guess: object = None
    guess_damping: float = 1e-3
    multi_start: int = 1
    retries: int = 4
    seed: int = 0
    dynamics: str = "auto"
    time_limit: float | None = None  # s
    track: bool = True

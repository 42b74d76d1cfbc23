"""The keys of a scene's table [plan]."""

from ..planning.goal import GOALS
from ..planning.nlp.coordinates import KINDS
from ..planning.nlp.node import FORMULATIONS
from ..planning.nlp.rules import FAMILIES, MOST_DEGREE
from ..planning.problem import OBJECTIVES
from ..planning.settings import CHOSEN, DYNAMICS, WHOLE_NUMBERS
from .keys import Key, one_word

FREE = "free"  # TOML has no None
WORK = Key("N m s")
Q_UNITS = ("m",) * 3 + ("1",) * 4 + ("rad",)  # of q; the last one of all tail coordinates
V_UNITS = ("m/s",) * 3 + ("rad/s",)


def _whole(least: int, most: int) -> Key:
    """Return the key of a whole number."""
    return Key(form={"type": "integer", "minimum": least, "maximum": most})


def _free(unit: str) -> Key:
    """Return the key of numbers that may be left free."""
    return Key(unit, depth=1, words=(FREE,))


def _bound(unit: str) -> Key:
    """Return the key of a bound: it may be as wide as it likes."""
    return Key(unit, depth=1, usual=False)


GOAL = {
    "attitude": Key("1", depth=1, words=("upright", FREE)),
    "torso_rate": _free("rad/s"),
    "tail": _free("rad"),
    "tail_rate": _free("rad/s"),
    "turns": _free("1"),
}
BOUNDS = {
    "angle": _bound("rad"),
    "rate": _bound("rad/s"),
    "torque": _bound("N m"),
    "torque_rate": _bound("N m/s"),
}
FREE_START = {
    "position": Key("m", depth=2),
    "attitude": Key("rad", depth=2),
    "tail": Key("rad", depth=2),
    "velocity": Key("m/s", depth=2),
    "torso_rate": Key("rad/s", depth=2),
    "tail_rate": Key("rad/s", depth=2),
}
# of parameters, whose units the model knows
PAIR = {"type": "array", "minItems": 2, "maxItems": 2}
RANGES = {"type": "object", "additionalProperties": PAIR}
PLAN = Key(
    keys={
        "start": Key(
            keys={"q": Key(Q_UNITS, depth=1), "v": Key(V_UNITS, depth=1)}, needs=("q", "v")
        ),
        "goal": Key(keys=GOAL, words=tuple(GOALS)),
        "duration": Key("s", depth=1),
        "bounds": Key(keys=BOUNDS),
        # of the problem
        "objective": one_word(*OBJECTIVES),
        "smoothing": WORK,
        "damping": WORK,
        "clearance": Key("m"),
        "formulation": one_word(*FORMULATIONS),
        "attitude": one_word(*KINDS),
        "design": Key(form=RANGES),
        "free_start": Key(keys=FREE_START),
        # of the search
        **{name: _whole(*bounds) for name, bounds in (WHOLE_NUMBERS | CHOSEN).items()},
        "rule": one_word(*FAMILIES),
        "degree": _whole(1, MOST_DEGREE),
        "tolerance": Key("deg", words=(FREE,)),
        "tail_tolerance": Key("deg", words=(FREE,)),
        "rate_tolerance": Key("rad/s", words=(FREE,)),
        "solver": Key(form={"type": "string", "pattern": "^[a-z]+$"}),
        "options": Key(form={"type": "object"}),
        "guess_damping": WORK,
        "dynamics": one_word(*DYNAMICS),
        "time_limit": Key("s", usual=False),
        "track": Key(form={"type": "boolean"}),
    },
    needs=("start", "duration"),
)

"""The keys of a scene's table [simulate]."""

from serpentail_scene.keys import Key, one_word

from ..model.state import START as WORDS
from ..simulation.controllers.moves import MOVE, TOUCH_DOWN
from ..simulation.controllers.piecewise import SHAPES
from ..simulation.controllers.schedules import BLENDS
from ..simulation.methods import SETTINGS

SECONDS, METRES, ANGLE = Key("s"), Key("m"), Key("rad")
RATE, PURE, FLAG = Key("rad/s"), Key("1"), Key(form={"type": "boolean"})
TIMES, BENDS = Key("s", depth=1), Key("rad", depth=3)
DAMPING = Key("N m s", depth=1)
WHOLE = Key(form={"type": "integer", "minimum": 1})
# settings of all methods, each once
NUMBERS = (*dict.fromkeys(name for names in SETTINGS.values() for name in names), "output_step")
SETTING = {name: SECONDS if name.endswith("step") else PURE for name in NUMBERS}

START = WORDS | {"settle": Key(keys={"rounds": WHOLE, "duration": SECONDS})}
MOVES = {name: Key(unit) for name, unit in MOVE.items()}
MOVES |= {"at": Key("s", words=(TOUCH_DOWN,)), "shape": one_word(*SHAPES)}
LEGS = {
    "gamma": Key("rad", depth=2),
    "delta": Key("rad", depth=2),
    "moves": Key(each=Key(keys=MOVES, needs=("at",))),
    "times": TIMES,
}
REFERENCE = {
    "times": TIMES,
    "bends": BENDS,
    "blend": one_word(*BLENDS),
    "file": Key(form={"type": "string"}),
}
LAWS = {  # kinds of controllers and what each has
    "none": {},
    "damping": {"damping": DAMPING},
    "pfl": {
        "kp": Key("1/s^2"),
        "kd": Key("1/s"),
        "feedforward": FLAG,
        "torque": Key("N m", depth=1),
    },
    "torques": {"times": TIMES, "torques": Key("N m", depth=2), "damping": DAMPING},
}


def _controllers(more: dict[str, Key]) -> dict[str, Key]:
    """Return the keys of each kind of controller, and more."""
    return {
        kind: Key(keys={"kind": one_word(kind), **keys, **more}, needs=("kind", *more))
        for kind, keys in LAWS.items()
    }


POINT = {"anyOf": [{"const": "torso"}, {"type": "array", "items": {"type": ["string", "integer"]}}]}
LOAD = {"point": Key(form=POINT), "times": TIMES, "force": Key("N", depth=2)}
LAWS_OF_ONE = _controllers({})
SIMULATE = Key(
    keys={
        "duration": SECONDS,
        "method": one_word("auto", *SETTINGS),
        **SETTING,
        "start": Key(keys=START),
        "legs": Key(keys=LEGS, needs=("gamma", "delta")),
        "prescribed": Key(form={"type": "object"}),  # its other keys are names of chains
        "load": Key(each=Key(keys=LOAD, needs=tuple(LOAD))),
        "reference": Key(keys=REFERENCE),
        "controller": Key(kinds=LAWS_OF_ONE, each=Key(kinds=_controllers({"begin": SECONDS}))),
    },
    needs=(),  # a duration, but for scenes with phases
)

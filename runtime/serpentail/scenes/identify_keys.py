"""The keys of a scene's table [identify]."""

from ..identification.tracks import AXES, UNITS, ZEROS
from .keys import Key, one_word

MARKER = Key(
    keys={
        "name": Key(form={"type": "string"}),
        "torso": Key("m", depth=1),
        "tail": Key("1"),
        "offset": Key("m", depth=1),
    },
    needs=("name",),
)
IDENTIFY = Key(
    keys={
        "estimate": Key(form={"type": "array", "items": {"type": "string"}}),
        "marker": Key(each=MARKER),
        "torques": Key(
            keys={"std": Key("N m"), "time": Key("s")}, needs=("std", "time"), words=("none",)
        ),
        "noise": Key("m"),
        "confidence": Key("1"),
        "unit": one_word(*UNITS),
        "axes": Key(form={"type": "string", "pattern": AXES}),
        "zeros": one_word(*ZEROS),
    },
    needs=("marker",),
)

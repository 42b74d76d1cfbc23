"""The keys of a scene's table [sweep]."""

from .keys import Key

NAME = {"type": "string"}
SWEEP = Key(
    keys={
        "run": Key(form={"enum": ["simulate", "plan", "identify"]}),
        "over": Key(form={"type": "object"}),
        "points": Key(form={"type": "integer", "minimum": 1}),
        "seed": Key(form={"type": "integer", "minimum": 0}),
        "outputs": Key(form={"type": "array", "items": NAME}),
        "limit": Key(form={"type": "number", "exclusiveMinimum": 0}),
        "store": Key(form={"type": "string"}),
    },
    needs=("over",),
)

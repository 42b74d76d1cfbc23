"""The keys of a scene's tables [[phase]]."""

from ..sequence.phase import AIRBORNE, BEFORE, GIVEN, LANDING
from ..simulation.ground import KINDS
from .keys import Key
from .plan_keys import PLAN
from .simulate_keys import LAWS_OF_ONE, METRES, MOVES, REFERENCE, SECONDS

EVENT = {"type": "array", "prefixItems": [{"enum": list(KINDS)}, {"type": "string"}]}
UNTIL = {"anyOf": [{"enum": [AIRBORNE, LANDING]}, {"type": "array", "items": EVENT}]}
WITHOUT_START = {name: key for name, key in PLAN.keys.items() if name not in GIVEN}
PHASE = Key(
    keys={
        "name": Key(form={"type": "string"}),
        "duration": SECONDS,
        "until": Key(form=UNTIL),
        "clearance": METRES,
        "controller": Key(kinds=LAWS_OF_ONE),
        "reference": Key(keys=REFERENCE),
        "plan": Key(keys=WITHOUT_START, each=Key(keys=WITHOUT_START)),
        "tracking": Key(keys={"kp": Key("1/s^2"), "kd": Key("1/s"), "early": SECONDS}),
        "moves": Key(each=Key(keys=MOVES | {BEFORE: SECONDS})),
    },
    needs=("name", "duration"),
)
PHASES = Key(each=PHASE)

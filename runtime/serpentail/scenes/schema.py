"""The JSON Schema of scene files, with the tables that the runtime reads."""

from typing import Any

from serpentail_scene import schema
from serpentail_scene.keys import Key

from .identify import IDENTIFY
from .keys import SWEEP
from .phases import PHASE
from .plan import PLAN
from .simulate_keys import SIMULATE

TABLES = {
    "simulate": SIMULATE,
    "phase": Key(each=PHASE),
    "plan": PLAN,
    "identify": IDENTIFY,
    "sweep": SWEEP,
}


def scene_schema() -> dict[str, Any]:
    """Return the schema of scene files."""
    return schema.scene_schema(TABLES)

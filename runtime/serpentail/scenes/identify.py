"""The identification that a scene file's table [identify] asks for."""

from collections.abc import Mapping, Sequence
from typing import Any

from serpentail_scene.keys import Key, one_word

from ..basics.checks import Refusals, needed
from ..basics.errors import IdentificationError
from ..identification.identify import identify
from ..identification.marker_files import read_markers
from ..identification.placement import Marker
from ..identification.result import Identification
from ..identification.torques import TorquePrior
from ..identification.tracks import AXES, UNITS, ZEROS
from .file import UNSIZED, model_of, read_scene, size_of, subtable, values_of

# the keys of a table [[identify.marker]], and of [identify]
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
READING = ("unit", "axes", "zeros")  # keys for reading files


def identified(path: str, data: Sequence[str], folder: str | None = None) -> Identification:
    """Return the identification that a scene's table [identify] describes, for marker files.

    path: a scene file, or the name of an example; data: TRC, CSV or C3D files, trials of one
    animal; folder: the model's generated folder; None: the model is built with the derivatives that
    are needed, or taken from the cache. Raises IdentificationError with field, value and remedy.
    """
    tables, place = read_scene(path, IdentificationError)
    table = subtable(tables, "identify", place, IdentificationError)
    arguments = identify_arguments(table)  # errors are raised before a model is built
    reading = {name: arguments[name] for name in READING if name in arguments}
    tracks = [read_markers(each, **reading) for each in data]
    model = model_of(tables, place, folder, {})
    arguments = identify_arguments(table, size_of(model))
    return identify(model, tracks, **{"estimate": ()} | arguments)


def identify_arguments(table: Mapping, size: Mapping[str, float] = UNSIZED) -> dict[str, Any]:
    """Return the arguments of ``identify`` that a table [identify] has, in the size of a body.

    IdentificationError has a line for each key that is wrong.
    """
    refused = Refusals(IdentificationError)
    arguments = values_of(table, IDENTIFY, "identify", size, refused)
    markers = _markers(arguments.pop("marker", None), refused)
    torques = arguments.pop("torques", "none")
    if isinstance(torques, Mapping):
        if set(torques) == {"std", "time"}:
            arguments["torques"] = TorquePrior(**torques)
        else:
            refused.add("torques", needed("identify.torques", dict(torques), "std and time"))
    elif torques != "none":
        refused.add("torques", needed("identify.torques", torques, 'std and time, or "none"'))
    refused.tell()
    return arguments | {"markers": markers}


def _markers(rows: Any, refused: Refusals) -> dict[str, Marker]:
    """Return markers by name of tables [[identify.marker]]."""
    markers: dict[str, Marker] = {}
    if not isinstance(rows, list) or not rows:
        needs = 'tables [[identify.marker]], such as name = "nose", torso = "0, 50, 15 mm"'
        refused.add("marker", needed("identify.marker", rows, needs))
        return markers
    for k, row in enumerate(rows):
        name = row.get("name") if isinstance(row, Mapping) else None
        if not isinstance(name, str) or name in markers:
            needs = "a table with a name that no other marker has"
            refused.add("marker", needed(f"identify.marker[{k}]", row, needs))
        elif set(row) <= {"name", "torso", "tail", "offset"}:
            markers[name] = Marker(**{key: row[key] for key in row if key != "name"})
    return markers

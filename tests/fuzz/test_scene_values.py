"""Whatever a key of a scene holds, it is taken or refused by name: no traceback."""

import datetime
import tomllib
import warnings
from functools import cache

import pytest

import serpentail as st
from serpentail.bridges.sweeps.points import axes_of
from serpentail.bridges.sweeps.scene import arguments_of
from serpentail.scenes.identify import identify_arguments
from serpentail.scenes.plan import plan_arguments
from serpentail.scenes.schema import TABLES
from serpentail.scenes.simulate import scenario_of
from serpentail_codegen.scene.parse import parse_scene
from serpentail_codegen.scene.problems import SceneError
from serpentail_scene.keys import KEYS
from serpentail_scene.parameters import NAMES
from tests.support import zoo
from tests.support.rows import row
from tests.support.scenes import SCENES, VALID

# numbers, texts, truths, dates, lists and tables, also empty and of one another
WRONG = (
    *(3, 0, -1.5, float("nan"), 10**400, "", "x", "3 kg", True, datetime.date(2000, 1, 1)),
    *([], [1], ["x"], [[]], [{}], [True], [1, "x", {}], [[[[[1.0]]]]], {}, {"x": 1}, {"x": {}}),
    *({"kind": []}, {"kind": 3}, {"shape": {}}, {"name": [{}]}),
)
EVERY = 13  # one in so many places and values is tried
TORSO = {"shape": "box", "sides": ["1 cm"] * 3, "density": 1000}
OF_BODY = {"body": {"scale": 2, "mass": "1 kg", "torso": TORSO}}
OF_SEGMENTS = {"segments": [{"links": 2, "length": 0.1, "mass": 1}], "taper": {"radii": [1, 2]}}
SWEPT = {"run": "simulate", "points": 8, "store": "a.rows", "over": {"tail_mass": {"grid": [1, 2]}}}
SWEPT["over"] |= {"duration": [0.1], "start.pitch": {"random": [-1.0, 1.0], "law": "uniform"}}


def paths(value, at=()):
    """The places of all values in a table, as keys and numbers."""
    entries = value.items() if isinstance(value, dict) else enumerate(value)
    for name, entry in entries:
        yield (*at, name)
        if isinstance(entry, dict | list):
            yield from paths(entry, (*at, name))


def known(key, at=()):
    """The places of all keys that a table may have."""
    if key.each:
        yield from known(key.each, (*at, 0))
    for table in (key, *key.kinds.values()):
        for name, each in table.keys.items():
            yield (*at, name)
            yield from known(each, (*at, name))


def put(value, path, new):
    """A copy of a table with a new value at a place; tables on the way are made."""
    if not path:
        return new
    first, *rest = path
    if isinstance(first, int):
        found = list(value) if isinstance(value, list) and value else [{}]
    else:
        found = dict(value) if isinstance(value, dict) else {}
    old = found[first] if isinstance(first, int) else found.get(first, {})
    found[first] = put(old, rest, new)
    return found


@cache
def tables(name):
    return tomllib.loads((SCENES / f"{name}.toml").read_text())


def generated(table):
    parse_scene(table, "x")


def simulated(table):
    scenario_of(zoo.model("ground"), table, SCENES, tables("kick_and_land")["phase"])


def unsettled():
    """A run of a whole scene whose start takes no time."""
    return tables("kick_and_land")["simulate"] | {"start": {}}


def in_phases(phases):
    scenario_of(zoo.model("ground"), unsettled(), SCENES, phases)


def swept(monkeypatch):
    def read(table):
        monkeypatch.setattr(
            "serpentail.bridges.sweeps.scene.read_scene", lambda *_: ({"sweep": table}, SCENES)
        )
        found = arguments_of("x")
        axes_of(found["over"], found.get("points"), found.get("seed", 0))

    return read


def test_a_value_of_a_wrong_kind_is_refused_by_name(monkeypatch):
    """Each key gets each wrong value; the quick test takes one in thirteen."""
    short = {(key,) for key in KEYS} | {("parameters", name) for name in NAMES}
    one, kick = tomllib.loads(VALID), tables("kick_and_land")
    phases = [(0, *place) for place in known(TABLES["phase"].each)]
    plan, identify = tables("righting_m1_n3")["plan"], tables("identify_tail")["identify"]
    rows = (
        ("scene", one | OF_BODY, generated, short),
        ("segments", one | OF_SEGMENTS, generated, ()),
        ("simulate", unsettled(), simulated, known(TABLES["simulate"])),
        ("phase", kick["phase"], in_phases, phases),
        ("plan", plan, plan_arguments, known(TABLES["plan"])),
        ("identify", identify, identify_arguments, known(TABLES["identify"])),
        ("sweep", SWEPT, swept(monkeypatch), known(TABLES["sweep"])),
    )
    for name, table, read, further in rows:
        places = sorted({*paths(table), *further}, key=str)
        cases = [(path, value) for path in places for value in WRONG]
        refused = 0
        for path, value in cases[::EVERY]:
            with row(name, path, repr(value)[:80]), warnings.catch_warnings():
                warnings.simplefilter("ignore", st.UnusualSize)
                try:
                    read(put(table, path, value))
                except (SceneError, st.SerpentailError) as error:
                    refused += 1
                    assert all(line.isprintable() for line in str(error).splitlines())
        assert refused > len(cases) // EVERY // 10, name


def test_values_that_were_tracebacks_are_refused_by_name(monkeypatch):
    with pytest.raises(SceneError, match=r"^body.torso: value \{'shape': \{\}\}: needs"):
        generated(tomllib.loads(VALID) | {"body": {"torso": {"shape": {}}}})
    absurd = {"kind": "mixed", "segments": [{"kind": "articulated", "links": 10**5000}]}
    with pytest.raises(SceneError, match=r"segments\[0\].links: value .*too long .*10000"):
        generated(absurd)
    for value in (5, {}, [], True):
        with (
            row(value),
            pytest.raises(st.SweepError, match=r"^sweep.store: value .*: needs a text"),
        ):
            swept(monkeypatch)(SWEPT | {"store": value})

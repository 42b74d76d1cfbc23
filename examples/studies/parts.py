"""Parts of long studies: each is kept as a file and made anew only where its sources changed."""

import hashlib
import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

import serpentail as st
from serpentail.files import replacing
from serpentail.motion.trajectory import ARRAYS


def say(words: str) -> None:
    """Tell on stderr what is going on."""
    print(f"  {words}", file=sys.stderr, flush=True)


def run(main: Callable[..., None], *arguments: object) -> None:
    """Run a study, and tell in one line what ends it: an error, or Ctrl-C (status 130)."""
    try:
        main(*arguments)
    except st.SerpentailError as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        say("interrupted; what is finished is kept")
        sys.exit(130)


def planned(model: st.Model, **settings) -> st.Plan:
    """Return a plan; KeyboardInterrupt where Ctrl-C ended its search: a part is whole or none."""
    plan = st.plan(model, **settings)
    if plan.report["stopped"] == "interrupt":
        raise KeyboardInterrupt
    return plan


def part(path: Path, of: dict, make: Callable[[], dict | list]) -> dict | list:
    """Return what the JSON file has if it was made of the same `of`, else make() and write it,
    whole or not at all.
    """
    of = json.loads(json.dumps(of))
    try:
        found = json.loads(path.read_text())
        if found["of"] == of:
            return found["result"]
    except (OSError, ValueError, KeyError, TypeError):
        pass  # none, or not a part
    say(path.stem)
    result = json.loads(json.dumps(make()))
    with replacing(path) as new:
        new.write_text(json.dumps({"of": of, "result": result}) + "\n")
    return result


def digest(*sources: Path) -> str:
    """Return a hash of Python sources and templates, files or folders: what makes a part is what it
    depends on, too.
    """
    inside = [
        p
        for source in sources
        for p in (sorted(source.rglob("*")) if source.is_dir() else [source])
    ]
    files = [p for p in inside if p.suffix in (".py", ".jinja")]
    return hashlib.sha256(b"\0".join(p.read_bytes() for p in files)).hexdigest()[:16]


def as_lists(flight: st.Trajectory) -> dict[str, list]:
    """Return a flight as lists."""
    return {name: getattr(flight, name).tolist() for name in ARRAYS}


def as_flight(lists: dict[str, list]) -> st.Trajectory:
    """Return the flight of lists."""
    return st.Trajectory(**{name: np.array(values) for name, values in lists.items()})

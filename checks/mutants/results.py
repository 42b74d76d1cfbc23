"""The verdicts on mutants: stored in output/mutants, shown as a score and a list of survivors."""

import json
import tomllib
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

from . import tree
from .mutation import Mutation
from .sample import PARTS, part_of

OUTPUT = tree.ROOT / "output" / "mutants"
ARGUED = Path(__file__).with_name("equivalent.toml")


@dataclass(frozen=True)
class Verdict:
    """The verdict on a mutant."""

    mutation: Mutation
    killed: bool
    by: str  # the test that failed first, or "timeout"
    words: str  # its message; for a survivor, a remark
    tests: int  # that ran
    seconds: float
    source: str  # digest of the file
    state: str  # digest of everything on which the verdict depends


def keep(verdict: Verdict) -> None:
    """Write a verdict."""
    OUTPUT.mkdir(parents=True, exist_ok=True)
    part = OUTPUT / f".{verdict.mutation.key}.part"
    part.write_text(json.dumps(asdict(verdict), indent=1))
    part.replace(OUTPUT / f"{verdict.mutation.key}.json")


def kept(mutation: Mutation, state: str) -> Verdict | None:
    """Return an earlier verdict that holds still: of the same sources and tests, or a kill of the
    same file.
    """
    path = OUTPUT / f"{mutation.key}.json"
    if not path.exists():
        return None
    told = json.loads(path.read_text())
    found = Verdict(**told | {"mutation": Mutation(**told["mutation"])})
    same = found.source == tree.digest(mutation.path)
    return found if found.state == state or (found.killed and same) else None


def arguments() -> list[dict]:
    """Return mutants that change nothing that matters: file, line, change, and the reason."""
    return tomllib.loads(ARGUED.read_text())["equivalent"]


def argument(mutation: Mutation, argued: Iterable[dict]) -> str:
    """Return the reason why a mutant changes nothing that matters; "" if none is given."""
    for entry in argued:
        if (entry["file"], entry["line"], entry["change"]) == (
            mutation.path,
            mutation.text,
            mutation.change,
        ):
            return entry["why"]
    return ""


def report(verdicts: list[Verdict]) -> str:
    """Return the score of each part, and the survivors with what is argued of them."""
    argued = arguments()
    rows, survivors = [], []
    for part in (*PARTS, "all"):
        of = [v for v in verdicts if part in (part_of(v.mutation.path), "all")]
        alive = [v for v in of if not v.killed]
        equal = [v for v in alive if argument(v.mutation, argued)]
        counted = len(of) - len(equal)
        score = 100 * (len(of) - len(alive)) / counted if counted else 100.0
        rows.append(
            f"{part:10} {len(of):4} mutants, {len(alive):3} survived, {len(equal):3} of them "
            f"argued equivalent: {score:5.1f} %"
        )
    for v in (v for v in verdicts if not v.killed):
        why = argument(v.mutation, argued)
        survivors += [
            f"{v.mutation.path}:{v.mutation.line}",
            f"    {v.mutation.text}",
            f"    {v.mutation.change}",
            f"    {v.tests} tests; {v.words or 'none noticed'}",
            f"    equivalent: {why}" if why else "    SURVIVED",
        ]
    ends = Counter(v.by for v in verdicts if v.killed and v.by in ("timeout", "process"))
    rows += [f"{count} of the killed ended by {end}" for end, count in ends.items()]
    return "\n".join([*rows, *survivors])


def score(verdicts: list[Verdict]) -> float:
    """Return how many percent of the mutants that can be noticed were noticed."""
    argued = arguments()
    counted = [v for v in verdicts if v.killed or not argument(v.mutation, argued)]
    return 100 * sum(v.killed for v in counted) / max(1, len(counted))

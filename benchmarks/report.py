"""Writes the benchmark's report as Markdown and JSON, with what changed since the last run."""

import itertools
import json
from pathlib import Path

from benchmarks.targets import judged

NOTABLE = 1.15  # ratio to the last run from which a figure is listed
TARGETS = "What is asked, what was found in this run, by minima."


def written(folder: Path, report: dict, words: dict[str, str]) -> str:
    """Write report.json and report.md, compared with the last run; return the Markdown.

    words: what is said above the table of each measure.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "report.json"
    last = json.loads(path.read_text()) if path.is_file() else None
    sections = [("targets", TARGETS, judged(report))]
    sections += [(name, words[name], report[name]) for name in words]
    sections.append(("seconds", "What each measure took.", report["seconds"]))
    sections.append(("since the last run", *changes(report, last)))
    lines = ["# Benchmark", "", "; ".join(str(value) for value in report["machine"].values())]
    for name, about, rows in sections:
        lines += ["", f"## {name}", "", about, "", *table(rows)]
    text = "\n".join([*lines, ""])
    (folder / "report.md").write_text(text)
    path.write_text(json.dumps(report, indent=1))
    return text


def changes(report: dict, last: dict | None) -> tuple[str, list[dict]]:
    """Return a sentence about the last run, and the times that differ from it by more than noise
    explains.
    """
    if last is None:
        return "This is the first run.", []
    if last["machine"] != report["machine"]:
        return "The last run was on another machine.", []
    rows = []
    for name, new in report.items():
        pairs = zip(new, last.get(name, []), strict=False) if isinstance(new, list) else ()
        for row, before in pairs:
            rows += [found for key in row if (found := change(name, row, before, key))]
    noise = f"the last run's by more than {NOTABLE - 1:.0%}"
    return f"Times that differ from {noise}; both may have been disturbed.", rows


def change(name: str, row: dict, before: dict, key: str) -> dict | None:
    """Return a time that changed."""
    old, new = before.get(key), row[key]
    is_time = key == "ns" or key.endswith((", ns", ", us", "ms", ", s"))
    if not is_time or which(row) != which(before):
        return None
    numbers = all(isinstance(x, float) and x > 0 for x in (old, new))
    if not numbers or 1 / NOTABLE < new / old < NOTABLE:
        return None
    found = {"measure": name, "of": which(row), "figure": key, "before": old, "now": new}
    return found | {"ratio": new / old}


def which(row: dict) -> str:
    """Return the name of a row: the texts that it begins with."""
    texts = itertools.takewhile(lambda value: isinstance(value, str), row.values())
    return ", ".join(texts) or str(next(iter(row.values())))


def table(rows: list[dict]) -> list[str]:
    """Return rows as a Markdown table, with the columns of all; a missing value is empty."""
    if not rows:
        return []
    keys = list(dict.fromkeys(key for row in rows for key in row))
    cells = [[cell(row.get(key, "")) for key in keys] for row in rows]
    return [f"| {' | '.join(line)} |" for line in (keys, ["---"] * len(keys), *cells)]


def cell(value: object) -> str:
    """Return a table cell; numbers to three digits."""
    return f"{value:.3g}" if isinstance(value, float) else str(value)

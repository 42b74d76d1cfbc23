"""Writes the benchmark's report as Markdown and HTML, with what changed since the last run."""

import html
import inspect
import itertools
import json
from pathlib import Path

from benchmarks import first_table
from benchmarks.closing import about, closing, figures
from benchmarks.fixtures import COLUMNS
from benchmarks.targets import judged

NOTABLE = 1.15  # ratio to the last run from which a figure is listed
TARGETS = "What is asked, what was found in this run, by minima; ratios: times slower."


def written(folder: Path, report: dict, words: dict[str, str], pictures: list[Path]) -> str:
    """Write report.json, report.md, report.html and figures.json, compared with the last run;
    return the Markdown.

    words: the docstring of each measure.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "report.json"
    last = json.loads(path.read_text()) if path.is_file() else None
    sections = [("closing", about(report), closing(report)), ("targets", TARGETS, judged(report))]
    sections += [(name, inspect.cleandoc(words[name]), report[name]) for name in words]
    sections.append(("seconds", "What each measure took.", report["seconds"]))
    sections.append(("since the last run", *changes(report, last)))
    head = "; ".join(str(value) for value in report["machine"].values())
    lines = ["# Benchmark", "", head, "", *(line for s in sections for line in markdown(*s))]
    lines += ["## docs/benchmarks.md", "", "Its first table:", "", *first_table.block(report), ""]
    text = "\n".join(lines)
    (folder / "report.md").write_text(text)
    (folder / "report.html").write_text(page(head, sections, pictures))
    (folder / "figures.json").write_text(json.dumps(figures(report), indent=1) + "\n")
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
    for name, table in report.items():
        pairs = zip(table, last.get(name, []), strict=False) if isinstance(table, list) else ()
        for row, before in pairs:
            rows += [r for key in row if (r := change(name, row, before, key))]
    about = (
        f"Times that differ from the last run's by more than {NOTABLE - 1:.0%}; both may have been "
        "disturbed."
    )
    return (
        about if rows else f"No time differs from the last run's by more than {NOTABLE - 1:.0%}.",
        rows,
    )


def change(name: str, row: dict, before: dict, key: str) -> dict | None:
    """Return one time that changed."""
    old, new = before.get(key), row[key]
    time = "ns" in key.split("_") or key.endswith((" ns", "_s", "_ms", "_us"))
    if not time or which(row) != which(before):
        return None
    if (
        not all(isinstance(x, float) and x > 0 for x in (old, new))
        or 1 / NOTABLE < new / old < NOTABLE
    ):
        return None
    return {
        "measure": name,
        "of": which(row),
        "figure": COLUMNS.get(key, key),
        "before": old,
        "now": new,
        "ratio": new / old,
    }


def which(row: dict) -> str:
    """Return the name of a row: the texts that it begins with."""
    texts = itertools.takewhile(lambda value: isinstance(value, str), row.values())
    return ", ".join(texts) or str(next(iter(row.values())))


def markdown(name: str, about: str, rows: list[dict]) -> list[str]:
    """Return a section as Markdown."""
    return [f"## {name.replace('_', ' ')}", "", about, "", *table(rows), ""]


def table(rows: list[dict]) -> list[str]:
    """Return rows as a Markdown table."""
    if not rows:
        return []
    lines = (heads(rows), ["---"] * len(keys(rows)), *body(rows))
    return ["| " + " | ".join(line) + " |" for line in lines]


def keys(rows: list[dict]) -> list[str]:
    """Return all columns, in the order in which rows have them."""
    return list(dict.fromkeys(key for row in rows for key in row))


def heads(rows: list[dict]) -> list[str]:
    """Return the columns' names."""
    return [COLUMNS.get(key, key) for key in keys(rows)]


def body(rows: list[dict]) -> list[list[str]]:
    """Return the cells; a missing value gives an empty cell."""
    return [[cell(row.get(key, "")) for key in keys(rows)] for row in rows]


def cell(value) -> str:
    """Return a table cell; numbers to three digits."""
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def page(head: str, sections: list[tuple], pictures: list[Path]) -> str:
    """Return the report as one HTML page beside its pictures."""
    style = (
        "body{font:15px sans-serif;max-width:70em;margin:2em auto}td,th{padding:.2em "
        ".8em;text-align:right}"
    )
    style += (
        "th{border-bottom:1px "
        "solid}td:first-child,th:first-child{text-align:left}img{max-width:100%}"
    )
    body = "".join(section(*s) for s in sections)
    body += "".join(f'<p><img src="{p.name}" alt="{p.stem}"></p>' for p in pictures)
    title = "<!doctype html><html lang=en><meta charset=utf-8><title>Benchmark</title>"
    return (
        f"{title}<style>{style}</style><h1>Benchmark</h1><p>{html.escape(head)}</p>{body}</html>\n"
    )


def section(name: str, about: str, rows: list[dict]) -> str:
    """Return a section as HTML."""
    lines = [cells("th", heads(rows)), *(cells("td", row) for row in body(rows))] if rows else []
    title = html.escape(name.replace("_", " "))
    return f"<h2>{title}</h2><p>{html.escape(about)}</p><table>{''.join(lines)}</table>"


def cells(kind: str, texts) -> str:
    """Return a row of an HTML table."""
    return "<tr>" + "".join(f"<{kind}>{html.escape(text)}</{kind}>" for text in texts) + "</tr>"

"""``compare``: runs beside each other, as a table of numbers, a figure and a page."""

import dataclasses
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import Any

from serpentail_scene.messages import one_line

from ..basics.errors import ViewError
from ..model.model import Model
from ..motion.numbers import UNITS
from ..motion.summary import summary
from ..motion.text import WIDTH, as_error, as_word
from ..motion.trajectory import Trajectory
from .motions import Shown, checked_models, checked_motions, checked_names
from .page.data import LABELS
from .page.view import view
from .pictures.plot import plot

WIDEST = 24  # characters of a cell: longer texts are cut
PHASES = "phase_end_s"  # when each phase of a sequence ended, which summaries do not have
Row = dict[str, Any]  # of the table, or of a run's numbers


@dataclass(frozen=True, eq=False)
class Comparison:
    """Two runs or more beside each other; ``print`` shows what differs, and warnings.

    Attributes
    ----------
    motions : dict of str to Trajectory
        The motions by name, with their models.
    rows : list of dict
        One for each number, ready for JSON: "number", such as "slip_m, feet"; "unit"; and by name
        of the run "values" (None where a run has no such number, of warnings their count),
        "errors" (None if not known), and "differences" to the first run.
    """

    motions: dict[str, Trajectory]
    rows: list[Row]

    def __repr__(self) -> str:
        return _table(list(self.motions), [row for row in self.rows if row["number"] in LABELS])

    def __str__(self) -> str:
        doubts = [f"{name}: {each}" for name, run in self.motions.items() for each in run.warnings]
        return "\n".join([_table(list(self.motions), self.rows), *doubts])

    def plot(self, *panels: str, **options: Any) -> Any:
        """Draw the runs over time, as ``serpentail.plot`` does; return figure and axes."""
        return plot(self.motions, *panels, **options)

    def view(self, path: str | os.PathLike[str] = "compare.html") -> Path:
        """Write an .html page of the runs, as ``serpentail.view`` does; return its path."""
        return view(self.motions, path)


def compare(
    motions: Mapping[str, Shown] | Sequence[Shown],
    *,
    names: Sequence[str] | None = None,
    model: Model | None = None,
    errors: bool = False,
) -> Comparison:
    """Compare two motions or more, which may differ in model, duration and phases.

    Parameters
    ----------
    motions : dict or sequence of Trajectory, str or path
        The motions or their .npz files; a dict has names as keys. The first is the reference.
    names : sequence of str, optional
        Names of the motions of a sequence. Default: the files, else "run 1", "run 2", ...
    model : Model, optional
        The model of motions that were read from files.
    errors : bool, default False
        Whether to estimate the numerical errors, as ``serpentail.summary`` does.

    Returns
    -------
    Comparison
        A table; ``rows`` has it as data, ``plot`` and ``view`` show the runs.

    Raises
    ------
    ViewError
        There are fewer than two motions, names are equal, or a file or a model is missing.

    Examples
    --------
    >>> st.compare({"long": motion, "short": other}).view("both.html")  # doctest: +SKIP
    """
    every, names = checked_motions(motions, names, model)
    if len(every) < 2:
        raise ViewError(f"motions: {len(every)}: needs two or more to compare")
    models = checked_models(every, model)
    runs, values, off = {}, {}, {}
    for name, motion, of in zip(checked_names(names, every), every, models, strict=True):
        runs[name] = motion if motion.model else dataclasses.replace(motion, model=of)
        numbers = summary(of, motion, errors)
        ends = {phase["name"]: phase["end"] for phase in motion.info.get("phases", [])}
        counted = {"warnings": len(numbers["warnings"]), PHASES: ends or None}
        values[name], off[name] = _flat("", numbers | counted), _flat("", numbers.errors)
    return Comparison(runs, _rows(values, off))


def _flat(name: str, value: Any) -> dict[str, Any]:
    """A number by its name; of groups, phases and directions each by its own."""
    if isinstance(value, list):
        value = dict(zip("xyz", value, strict=True))
    if not isinstance(value, dict):
        return {name: value}
    parts = [_flat(f"{name}, {part}".lstrip(", "), each) for part, each in value.items()]
    return {number: x for part in parts for number, x in part.items()}


def _rows(values: dict[str, Row], errors: dict[str, Row]) -> list[Row]:
    """One row for each number that a run has, in the order of the summaries."""
    units, rows = UNITS | {PHASES: "s"}, []
    every = dict.fromkeys(number for run in values.values() for number in run)
    for number in sorted(every, key=lambda each: list(units).index(each.split(", ")[0])):
        whole = number.split(", ")[0]
        of: Row = {name: run.get(number) for name, run in values.items()}
        row: Row = {"number": number, "unit": units[whole], "values": of}
        row["errors"] = {name: run.get(number, run.get(whole)) for name, run in errors.items()}
        (_, first), *others = of.items()
        numeric = {name: {type(first), type(x)} <= {int, float} for name, x in others}
        row["differences"] = {name: x - first if numeric[name] else None for name, x in others}
        rows.append(row)
    return rows


def _table(names: list[str], rows: list[Row]) -> str:
    """The rows that differ as a table, and the names of the others."""
    table, equal = [["", *names, *(f"{name} - {names[0]}" for name in names[1:]), "unit"]], []
    for row in rows:
        words = list(map(as_word, row["values"].values()))
        if len(set(words)) > 1:
            errors = map(as_error, row["errors"].values())
            cells = [" ".join(pair) for pair in zip(words, errors, strict=True)]
            signed = ["-" if d is None else f"{d:+.5g}" for d in row["differences"].values()]
            table.append([row["number"], *cells, *signed, row["unit"]])
        elif words[0] != as_word(None):
            equal.append(row["number"])
    table = [[line[0], *(one_line(cell.strip(), WIDEST) for cell in line[1:])] for line in table]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    lines = ["  ".join(map(str.ljust, line, widths)).rstrip() for line in table]
    return "\n".join([*lines, *wrap(f"equal: {', '.join(equal) or 'none'}", WIDTH)])

"""``compare``: runs beside each other, as a table of numbers, a figure and a page."""

import dataclasses
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from serpentail_scene.messages import one_line

from ..basics.errors import ViewError
from ..model.model import Model
from ..motion.numbers import UNITS
from ..motion.summary import Summary, summary
from ..motion.text import WIDTH, as_error, as_word
from ..motion.trajectory import Trajectory
from .motions import Shown, checked_models, checked_motions, checked_names
from .page.data import LABELS
from .page.view import view
from .pictures.plot import plot

WIDEST = 22  # characters of a cell: longer texts and names of runs are cut
PHASES = "phase_end_s"  # not in summaries: when each phase of a sequence ended
Part = tuple[str, Any, Any]  # name, value, error


@dataclass(frozen=True, eq=False)
class Comparison:
    """Two runs or more beside each other, as a table; ``print`` shows all numbers that differ.

    Attributes
    ----------
    motions : dict of str to Trajectory
        The motions by name, with their models.
    summaries : dict of str to Summary
        The numbers of each, as ``serpentail.summary`` gives them.
    """

    motions: dict[str, Trajectory]
    summaries: dict[str, Summary] = field(repr=False)

    @cached_property
    def rows(self) -> list[dict[str, Any]]:
        """One row for each number, ready for JSON, SI unless the name gives a unit.

        A row has "number", such as "slip_m, feet" for a part, "unit", and three dicts by name of
        the run: "values", None where a run has no such number (of warnings their number);
        "differences" to the first run; and "errors", the estimated numerical ones, None if unknown.
        """
        of_runs = [_numbers(self.motions[name], self.summaries[name]) for name in self.motions]
        rows = []
        for name in (*UNITS, PHASES):
            parts = [{part: rest for part, *rest in _parts(*run[name], name)} for run in of_runs]
            for part in dict.fromkeys(part for run in parts for part in run):
                values, errors = zip(*(run.get(part, (None, None)) for run in parts), strict=True)
                others = [_difference(values[0], value) for value in values]
                row: dict[str, Any] = {"number": part, "unit": UNITS.get(name, "s")}
                columns = {"values": values, "differences": others, "errors": errors}
                for key, column in columns.items():
                    row[key] = dict(zip(self.motions, column, strict=True))
                rows.append(row)
        return rows

    def __repr__(self) -> str:
        return self._table([row for row in self.rows if row["number"] in LABELS])

    def __str__(self) -> str:
        return self._table(self.rows)

    def _table(self, rows: list[dict[str, Any]]) -> str:
        """The rows that differ as a table, and the names of the others."""
        first, *others = (one_line(name, WIDEST) for name in self.motions)
        heads = ["", first, *(x for name in others for x in (name, "difference")), "unit"]
        words = [set(map(as_word, row["values"].values())) for row in rows]
        differ = [row for row, each in zip(rows, words, strict=True) if len(each) > 1]
        table = [heads, *([row["number"], *_cells(row), row["unit"]] for row in differ)]
        widths = [max(map(len, column)) for column in zip(*table, strict=True)]
        lines = ["  ".join(map(str.ljust, line, widths)).rstrip() for line in table]
        same = [
            row["number"]
            for row, each in zip(rows, words, strict=True)
            if len(each) == 1 and each != {as_word(None)}
        ]
        return "\n".join([*lines, one_line(f"equal: {', '.join(same) or 'none'}", WIDTH)])

    def plot(self, *panels: str, **options: Any) -> Any:
        """Draw the runs over time, one colour each; return Matplotlib's figure and its axes.

        Names of panels, options and errors are those of ``serpentail.plot``.
        """
        return plot(self.motions, *panels, **options)

    def view(self, path: str | os.PathLike[str] = "compare.html") -> Path:
        """Write an .html page of the runs, over each other or side by side; return its path.

        Errors are those of ``serpentail.view``.
        """
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
        The motions or their .npz files; a dict has names as keys. The first is what the others
        are compared with.
    names : sequence of str, optional
        Names of the motions of a sequence. Default: the files, else "run 1", "run 2", ...
    model : Model, optional
        The model of motions that were read from files.
    errors : bool, default False
        Whether to estimate the numerical error of each number, by making each motion again; see
        ``serpentail.summary``.

    Returns
    -------
    Comparison
        The numbers of the runs, differences and errors; ``rows``, ``plot`` and ``view``.

    Raises
    ------
    ViewError
        There are fewer than two motions, two names are equal, a file cannot be read, or a model
        is missing.

    Examples
    --------
    >>> both = st.compare({"long": motion, "short": other})  # doctest: +SKIP
    >>> both.view("both.html")  # doctest: +SKIP
    """
    every, names = checked_motions(motions, names, model)
    if len(every) < 2:
        raise ViewError(f"motions: {len(every)}: needs two or more to compare")
    models = checked_models(every, model)
    runs = {
        name: dataclasses.replace(motion, model=of) if motion.model is None else motion
        for name, motion, of in zip(checked_names(names, every), every, models, strict=True)
    }
    pairs = zip(runs.items(), models, strict=True)
    return Comparison(runs, {name: summary(of, run, errors) for (name, run), of in pairs})


def _numbers(motion: Trajectory, numbers: Summary) -> dict[str, tuple[Any, Any]]:
    """Value and error of each number of a run."""
    ends = {phase["name"]: phase["end"] for phase in motion.info.get("phases", [])}
    values = numbers | {PHASES: ends or None, "warnings": len(numbers["warnings"])}
    return {name: (value, numbers.errors.get(name)) for name, value in values.items()}


def _parts(value: Any, error: Any, name: str) -> Iterator[Part]:
    """A number, or the parts of one: of groups, phases, directions."""
    if isinstance(value, list):
        value = dict(zip("xyz", value, strict=True))
        error = dict(zip("xyz", error, strict=True)) if isinstance(error, list) else error
    if not isinstance(value, dict):
        yield name, value, error
        return
    for part, each in value.items():
        of = error.get(part) if isinstance(error, dict) else error
        yield from _parts(each, of, f"{name}, {part}")


def _difference(first: Any, other: Any) -> Any:
    """Other minus first; None unless both are numbers."""
    numbers = all(isinstance(x, int | float) and not isinstance(x, bool) for x in (first, other))
    return other - first if numbers else None


def _cells(row: dict[str, Any]) -> Iterator[str]:
    """The texts of a row: the first value, then value and difference of each other run."""
    values, errors = row["values"], row["errors"]
    first = next(iter(values))
    for name, value in values.items():
        yield one_line(f"{as_word(value)} {as_error(errors[name])}".strip(), WIDEST)
        if name != first:
            yield _signed(row["differences"][name], (errors[first], errors[name]))


def _signed(difference: float | None, errors: Sequence[Any]) -> str:
    """A difference with its sign and, if both errors are known numbers, their sum."""
    if difference is None:
        return "-"
    known = all(isinstance(error, float) for error in errors)
    text = f"{'+' if difference > 0 else ''}{as_word(difference)}"
    return f"{text} {as_error(sum(errors)) if known else ''}".strip()

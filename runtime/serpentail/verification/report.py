"""Verification: a loaded model goes in; the checks of its laws, each with its error and limit, come
out as a report.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass

import numpy as np

from ..errors import SerpentailError
from ..model.model import Model
from . import contact_laws, derivative_laws
from .law import Law
from .states import State, states
from .value_laws import LAWS as VALUE_LAWS

LAWS = (*VALUE_LAWS, *derivative_laws.LAWS, *contact_laws.LAWS)


@dataclass(frozen=True)
class Check:
    """A law in one sentence, the largest error found, and its limit; or why the law was not
    checked.
    """

    name: str
    law: str
    error: float
    limit: float
    where: str = ""  # the kind of state of the largest error, and the function
    omitted: str = ""

    @property
    def passed(self) -> bool:
        """No error above the limit was found; an error that is not a number is above any limit."""
        return bool(self.omitted) or bool(self.error <= self.limit)

    @property
    def status(self) -> str:
        """Return "passed", "failed", or "not checked"."""
        return "not checked" if self.omitted else "passed" if self.passed else "failed"


def laws(model: Model) -> list[Check]:
    """Return a check of every law, over seeded states of all kinds."""
    cases = list(states(model))
    return [check(entry, model, cases) for entry in LAWS]


def check(entry: Law, model: Model, cases: list[State]) -> Check:
    """Check one law; one that speaks of functions the scene left out is not checked, and says
    so.
    """
    limit, reason = entry.limit(model), unchecked(entry, model)
    if reason:
        return Check(entry.name, entry.text, 0.0, limit, omitted=reason)
    found = [item for case in cases for item in errors_at(entry, model, case)]
    if not found:
        return Check(
            entry.name, entry.text, 0.0, limit, omitted="not generated: any function it speaks of"
        )
    where, error = max(found, key=lambda item: (np.isnan(item[1]), item[1]))
    return Check(entry.name, entry.text, float(error), limit, "" if error == 0 else where)


def unchecked(entry: Law, model: Model) -> str:
    """Return why a law cannot be checked, or nothing."""
    absent = ", ".join(name for name in entry.needs if name not in model.generated)
    kinds = (
        "",
        model.manifest["real"],
        model.manifest["scene"]["kind"],
        *(["contact"] if model.contacts else []),
    )
    if entry.only not in kinds:
        return f"only for {entry.only} models"
    return f"not generated: {absent}" if absent else ""


def errors_at(entry: Law, model: Model, state: State) -> Iterator[tuple[str, float]]:
    """Yield (place, error) of one state; what the model refuses to compute is an error that is not
    a number.
    """
    try:
        with np.errstate(all="ignore"):  # what is no number fails
            errors = entry.error(model, state)
    except (SerpentailError, ValueError, ArithmeticError) as refusal:
        errors = {f"{refusal}".partition("\n")[0]: np.nan}
    for place, error in errors.items() if isinstance(errors, dict) else [("", errors)]:
        yield f"{state.kind}: {place}" if place else state.kind, error


def summary(model: Model, checks: list[Check]) -> dict:
    """Return the checks as plain data for JSON; an error that is no finite number is null."""
    rows = []
    for entry in checks:
        error = entry.error if np.isfinite(entry.error) and not entry.omitted else None
        rows.append(asdict(entry) | {"error": error, "status": entry.status})
    counts = {
        status: sum(c.status == status for c in checks)
        for status in ("passed", "failed", "not checked")
    }
    head = {
        "name": model.name,
        "real": model.manifest["real"],
        "segments": model.segments,
        "links": model.links,
    }
    return head | {"passed": all(c.passed for c in checks), "counts": counts, "checks": rows}


def as_text(model: Model, checks: list[Check]) -> str:
    """Return the checks as a table, what failed with its law."""
    counts = summary(model, checks)["counts"]
    lines = [f"{model.name}: " + ", ".join(f"{count} {status}" for status, count in counts.items())]
    width = max(len(c.name) for c in checks)
    lines.append(f"  {'check':<{width}}  {'error':>9}  {'limit':>9}  ")
    for c in checks:
        if c.omitted:
            lines.append(f"  {c.name:<{width}}  not checked: {c.omitted}")
            continue
        lines.append(
            f"  {c.name:<{width}}  {c.error:>9.2g}  {c.limit:>9.2g}  "
            f"{'' if c.passed else 'FAILED '}{c.where}"
        )
        if not c.passed:
            lines.append(f"  {'':<{width}}  {c.law}")
    return "\n".join(lines)

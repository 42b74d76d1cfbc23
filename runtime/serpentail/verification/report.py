"""The verification report: every law checked on seeded states of a model, its error and its limit.

`serpentail verify` checks the laws; `make verify` adds checks against other derivations of the
model and reports them in the same form.
"""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from serpentail_scene.parameters import PARTS

from ..basics.errors import ExtraMissing, SerpentailError
from ..basics.extras import needed
from ..model.chains import refuse_given
from ..model.model import Model
from ..model.passive import idle
from . import (
    acting_laws,
    airborne_laws,
    call_laws,
    contact_laws,
    derivative_laws,
    frame_laws,
    value_laws,
)
from .law import Law, rid_of
from .states import Case, states

FILES = (
    *(value_laws, frame_laws, call_laws, derivative_laws),
    *(contact_laws, acting_laws, airborne_laws),
)
LAWS = tuple(each for file in FILES for each in vars(file).values() if isinstance(each, Law))
OF = {"free": "a torso that moves"}
STATUSES = ("passed", "failed", "not checked")


@dataclass(frozen=True)
class Check:
    """A law in one sentence, its largest error and its limit; or why it was not checked."""

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
        if self.omitted:
            return "not checked"
        return "passed" if self.passed else "failed"

    @property
    def ratio(self) -> float:
        """Error divided by limit: inf for nan, 0 if nothing is checked or allowed."""
        if self.omitted or not self.limit:
            return 0.0
        return float(np.nan_to_num(self.error / self.limit, nan=np.inf))

    @property
    def group(self) -> str:
        """What comes before the colon of its name, such as another derivation; else "laws"."""
        return self.name.partition(": ")[0] if ": " in self.name else "laws"


def laws(model: Model) -> list[Check]:
    """Return a check of every law, over seeded states of all kinds."""
    refuse_given(model, "verify")
    cases = list(states(model))
    return [check(entry, model, cases) for entry in LAWS]


def check(entry: Law, model: Model, cases: list[Case]) -> Check:
    """Check one law; one that speaks of functions the scene left out says so."""
    limit, reason = entry.limit(model), unchecked(entry, model)
    model = model if reason else rid_of(model, entry.without)
    errors = [] if reason else [pair for case in cases for pair in errors_at(entry, model, case)]
    if not errors:
        omitted = reason or "it says nothing about this model"
        return Check(entry.name, entry.text, 0.0, limit, omitted=omitted)
    where, error = max(errors, key=lambda pair: (np.isnan(pair[1]), pair[1]))
    return Check(entry.name, entry.text, float(error), limit, "" if error == 0 else where)


def unchecked(entry: Law, model: Model) -> str:
    """Return why a law cannot be checked, or nothing."""
    kinds = ["", model.manifest["real"], model.manifest["scene"]["kind"]]
    kinds += ["contact"] if model.contacts else []
    kinds += [] if model.fixed else ["free"]
    kinds += ["passive"] if idle(model.parameters, PARTS) else []
    kinds += ["air"] if idle(model.parameters, ("air",)) else []
    kinds += ["tendons"] if model.layout.tendons else []
    if entry.only not in kinds:
        return f"only for {OF.get(entry.only, entry.only + ' models')}"
    if entry.casadi:
        try:
            needed("casadi", "plan")
        except ExtraMissing as missing:
            return str(missing)
    changed = entry.only in ("passive", "air") or idle(model.parameters, entry.without)
    if changed and model.manifest["scene"]["baked"]:
        return "the passive tail and the air cannot be left out: parameters are baked"
    absent = ", ".join(name for name in entry.needs if name not in model.generated)
    return f"not generated: {absent}" if absent else ""


def errors_at(entry: Law, model: Model, state: Case) -> Iterator[tuple[str, float]]:
    """Yield (place, error) of one state; nan if the model refuses to compute."""
    try:
        with np.errstate(all="ignore"):  # nan fails
            errors = entry.error(model, state)
    except (SerpentailError, ValueError, ArithmeticError) as refusal:
        errors = {f"{refusal}".partition("\n")[0]: np.nan}
    for place, error in errors.items() if isinstance(errors, dict) else [("", errors)]:
        yield f"{state.kind}: {place}" if place else state.kind, error


def counts(checks: list[Check]) -> dict[str, int]:
    """Return how many checks have each status."""
    return {status: sum(c.status == status for c in checks) for status in STATUSES}


def summary(model: Model, checks: list[Check]) -> dict[str, Any]:
    """Return the checks as plain data for JSON; an error that is not finite is null."""
    rows = []
    for entry in checks:
        error = entry.error if np.isfinite(entry.error) and not entry.omitted else None
        rows.append(asdict(entry) | {"error": error, "status": entry.status})
    return {
        "name": model.name,
        "real": model.manifest["real"],
        "segments": model.segments,
        "links": model.links,
        "passed": all(c.passed for c in checks),
        "counts": counts(checks),
        "checks": rows,
    }


def as_text(model: Model, checks: list[Check]) -> str:
    """Return the report: an overview, every check, what was not checked, and the verdict."""
    lines = [*_overview(model, checks), "", *_table(checks, lambda c: not c.omitted), ""]
    return "\n".join([*lines, *_omitted(checks), verdict(model, checks)])


def as_short_text(model: Model, checks: list[Check]) -> str:
    """Return the overview, then the checks that failed."""
    return "\n".join([*_overview(model, checks), *_table(checks, lambda c: not c.passed)])


def verdict(model: Model, checks: list[Check]) -> str:
    """Return one line: whether all that was checked holds, or what does not."""
    failed = [c.name for c in checks if not c.passed]
    if failed:
        return f"{model.name}: {len(failed)} FAILED: {', '.join(failed)}"
    return f"{model.name}: all {counts(checks)['passed']} laws that were checked hold"


def _omitted(checks: list[Check]) -> list[str]:
    """Return a line with how many checks were left out for which kind of reason, if any were."""
    reasons = Counter(c.omitted.partition(": ")[0] for c in checks if c.omitted)
    if not reasons:
        return []
    parts = ", ".join(f"{count} {reason}" for reason, count in reasons.items())
    return [f"not checked: {parts} (--json - names them)"]


def _overview(model: Model, checks: list[Check]) -> list[str]:
    """Lines: how many checks passed, and of every group also which came nearest to its limit."""
    total = ", ".join(f"{count} {status}" for status, count in counts(checks).items())
    lines = [f"{model.name}: {total}", f"  {'':<12}" + "".join(f"{s:>13}" for s in STATUSES)]
    lines[-1] += "   largest error / limit"
    groups: dict[str, list[Check]] = {}
    for entry in checks:
        groups.setdefault(entry.group, []).append(entry)
    for name, members in groups.items():
        numbers = "".join(f"{count:>13}" for count in counts(members).values())
        nearest = max(members, key=lambda c: c.ratio)
        about = f"{nearest.ratio:.2g}  {nearest.name.rpartition(': ')[2]}" if nearest.ratio else ""
        lines.append(f"  {name:<12}{numbers}   {about}")
    return lines


def _table(checks: list[Check], shown: Callable[[Check], bool]) -> list[str]:
    """Return lines with name, error, limit and place of checks; failed ones with their law."""
    rows = [c for c in checks if shown(c)]
    if not rows:
        return []
    width = max(len(c.name) for c in rows)
    lines = [f"  {'check':<{width}}  {'error':>9}  {'limit':>9}  largest at"]
    for c in rows:
        name = f"  {c.name:<{width}}  "
        verdict = "" if c.passed else "FAILED "
        lines.append(f"{name}{c.error:>9.2g}  {c.limit:>9.2g}  {verdict}{c.where}".rstrip())
        if not c.passed:
            lines.append(f"  {'':<{width}}  {c.law}")
    return lines

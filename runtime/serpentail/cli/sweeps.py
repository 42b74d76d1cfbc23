"""The verb that makes many runs: sweep."""

import argparse
from typing import Any

from ..basics.errors import SweepError
from .outcome import Outcome

LATER = ("executor", "retry_failed", "limit")  # of running alone


def sweep(arguments: argparse.Namespace) -> Outcome:
    """Run the missing points of a scene's sweep, and return how far it is."""
    from ..bridges.sweeps.points import axes_of, checked_row
    from ..bridges.sweeps.scene import arguments_of
    from ..bridges.sweeps.sweep import posed
    from ..bridges.sweeps.sweep import sweep as swept
    from ..bridges.sweeps.tables import checked

    if arguments.export is not None:
        checked(arguments.export)
    given = arguments_of(arguments.scene)
    if arguments.view is not None:  # before anything runs
        points = len(axes_of(given["over"], given.get("points"), given.get("seed", 0)))
        checked_row(arguments.row, points)
    if arguments.store is not None:
        given["store"] = arguments.store
    if arguments.status:
        if not given["store"].exists():
            raise SweepError(f"store: {given['store']} is not there yet: run it without --status")
        found = posed(**{name: value for name, value in given.items() if name not in LATER})
    else:
        found = swept(**given, executor=arguments.executor, retry_failed=arguments.retry_failed)
    status = found.status()
    report: dict[str, Any] = {"points": status.points, "done": status.done}
    report |= {"failed": status.failed, "store": str(given["store"])}
    text = f"{status}\nstore: {given['store']}"
    first = next((row for row in found if row["error"]), None) if status.failed else None
    if found.spent.hung:
        text += f"\n{found.spent.hung} of them hung, and have no row: the same call runs them again"
    if first is not None:
        report["first_failure"] = {"number": first["number"], "error": first["error"]}
        text += f"\nfirst failure, point {first['number']}: {first['error']}"
    if arguments.export is not None:
        text += f"\nwritten: {found.save(arguments.export)}"
    if arguments.view is not None:
        text += f"\npage of point {arguments.row}: {found.view(arguments.row, arguments.view)}"
    return Outcome(report, text, status.failed == 0)

"""Milliseconds for the caller against the error of 0.58 s of damped flight of (1, 3).

RK4, Tsit5 and DOP853 at several steps or tolerances; the largest error of q at the end.
"""

from functools import partial
from pathlib import Path

import serpentail as st
from benchmarks.drift import thrown
from benchmarks.models import built
from benchmarks.scenes import error_at_end
from benchmarks.timing import best

SPAN = 0.58  # s
SETTINGS = [("rk4", {"step": h}) for h in (4e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4)]
SETTINGS += [("tsit5", {"rtol": r, "atol": r}) for r in (1e-4, 1e-6, 1e-8, 1e-10)]
SETTINGS += [("dop853", {"rtol": r, "atol": r * 1e-2}) for r in (1e-4, 1e-6, 1e-8, 1e-10)]


def measured(folder: Path) -> list[dict]:
    """Return a row for each setting."""
    model, rows = built(1, 3), []
    damped = {"controller": st.Damping(1e-4), "t_span": SPAN, "output_step": SPAN / 5}
    fly = partial(st.simulate, model, *thrown(model), **damped)
    exact = fly(method="dop853", rtol=1e-13, atol=1e-15)
    for method, options in SETTINGS:
        again = partial(fly, method=method, **options)
        name, value = next(iter(options.items()))
        row = {"method": method, "setting": f"{name} {value:g}", "ms": best(again, 5) / 1e6}
        rows.append(row | {"error": error_at_end(again(), exact)})
    return rows

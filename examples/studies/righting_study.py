"""The parts of the righting study, and the use of their results."""

import json
from functools import partial
from pathlib import Path

import numpy as np

from examples import righting
from examples.front import ROOT
from examples.studies import righting_plans as plans
from examples.studies.parts import Part, as_flight, digest, made
from examples.studies.righting_figures import (
    draw_figure_10,
    draw_figure_11,
    draw_figure_13,
    draw_rates,
)
from examples.studies.righting_plans import RAT, rat

FREQUENCIES = (20, 40, 60, 80, 100, 150, 200)  # Hz, nodes a second
TAILS = ((1, 6), (2, 3), (3, 2))
MORE = ((4, 2), (5, 2), (6, 2), (1, None), (2, None), (3, None))
SEVERAL = ((2, 3), (3, 2), (1, None), (3, None))  # tails righted from random starts, besides (1, 3)
FEWER = 16  # times fewer starts for these
BLOCK = 10  # random starts that are kept together
SOURCES = ("examples/righting.py", "examples/studies/righting_plans.py", "runtime")


def name(segments: int, links: int | None) -> str:
    """Return a tail's name."""
    return f"({segments}, {links})" if links else f"continuum {segments}"


# ---- parts ---------------------------------------------------------------------------------------


def built(folder: Path) -> dict[tuple, str]:
    """Build the tails, and return hashes that distinguish their code."""
    sizes = {name(*size): size for size in (RAT, *TAILS, *MORE)}
    of = {"program": digest(ROOT / "codegen"), "functions": righting.FUNCTIONS}
    parts = {title: Part(partial(plans.content, size), of) for title, size in sizes.items()}
    found = made("tails", folder / "tails", parts)
    return {size: found[title]["content_hash"] for title, size in sizes.items()}


def examples() -> dict[str, tuple]:
    """Fig. 11: the cost and the benefit of more nodes, as the paper plans and as we do, on one
    random start.
    """
    parts = {}
    for frequency in FREQUENCIES:
        nodes = round(frequency * righting.FLIGHT)
        both = {"paper": righting.PAPER | {"intervals": nodes}}
        both["ours"] = {"intervals": max(2, nodes // 3), "tolerance": None, "retries": 0}
        for way, settings in both.items():
            make = partial(plans.example, settings)
            parts[f"Fig. 11 {way} {frequency} Hz"] = RAT, settings, make
    return parts


def segments() -> dict[str, tuple]:
    """Sect. 4.3: tails of six links, from the kick's state, as the paper plans (100 Hz) and
    true.
    """
    parts = {}
    for size in (*TAILS, *MORE):
        parts[f"Sect. 4.3 {name(*size)}"] = size, {}, partial(plans.true, size)
        if size in TAILS:
            parts[f"Sect. 4.3 {name(*size)} paper"] = size, {}, partial(plans.paper, size)
    return parts


def blocks(count: int) -> dict[str, dict[str, tuple]]:
    """Plans from random tumbling starts by kind, upright and, by default, at rest."""
    fewer, kinds = max(1, count // FEWER), {"(1, 3)": (RAT, count, False, {})}
    kinds["(1, 3), any rate"] = RAT, count, True, {}
    kinds["(1, 3), no smoothing"] = RAT, fewer, False, {"smoothing": 0.0}
    kinds |= {name(*size): (size, fewer, False, {}) for size in SEVERAL}
    return {kind: _blocks(kind, *given) for kind, given in kinds.items()}


def _blocks(kind: str, size: tuple, count: int, any_rate: bool, settings: dict) -> dict[str, tuple]:
    parts = {}
    for first in range(1, count + 1, BLOCK):
        starts = list(range(first, min(first + BLOCK, count + 1)))
        make = partial(plans.block, size, starts, any_rate, settings)
        told = settings | {"any_rate": any_rate}
        parts[f"{kind} starts {first} to {starts[-1]}"] = size, told, make
    return parts


# ---- results -------------------------------------------------------------------------------------


def draw_flights(folder: Path, found: dict) -> None:
    """Draw Figs. 9, 10, 12 and 13."""
    flights = {k: as_flight(lists) for k, lists in found["Sect. 4.2"]["flights"].items()}
    for kind, flight in flights.items():
        flight.filmstrip(folder / f"fig9_{kind}.png", model=rat(*RAT))
    draw_figure_10(flights, RAT[1], folder / "fig10.png")
    flights = {size: as_flight(found[f"Sect. 4.3 {name(*size)}"]["flight"]) for size in TAILS}
    for (m, n), flight in flights.items():
        flight.filmstrip(folder / f"fig12_m{m}_n{n}.png", model=rat(m, n))
    draw_figure_13(flights, {size: rat(*size) for size in TAILS}, folder / "fig13.png")


def summary(found: dict, kinds: dict[str, dict]) -> dict:
    """Return the contents of summary.json."""
    rows = []
    for m, n in (*TAILS, *MORE):
        title = f"Sect. 4.3 {name(m, n)}"
        rows.append({"segments": m, "links": n, "ours": found[title]["row"]})
        if f"{title} paper" in found:
            rows[-1]["paper"] = found[f"{title} paper"]
    frequencies = {
        way: [{"frequency": f} | found[f"Fig. 11 {way} {f} Hz"] for f in FREQUENCIES]
        for way in ("paper", "ours")
    }
    rates = {
        kind: [row for title in parts for row in found[title]] for kind, parts in kinds.items()
    }
    told = {"righting": found["Sect. 4.2"]["row"], "frequencies": frequencies}
    return told | {"segments": {"rows": rows}, "rates": rates}


def rate_lines(rates: dict[str, list[dict]]) -> list[str]:
    """Return the rates as text: successes, medians and tails of CPU time, error and objective."""
    lines = [
        "random starts          true      of  cpu: median    95 %   most [s]  err [deg]  objective"
    ]
    for kind, rows in rates.items():
        good = [r for r in rows if r["success"]]
        cpu = np.percentile([r["cpu_s"] for r in rows], [50, 95, 100])
        medians = [
            np.median([r[key] for r in good])
            for key in ("open_loop_attitude_error_deg", "objective")
        ]
        numbers = "{:>12.2f}{:>8.2f}{:>11.2f}{:>11.4f}{:>11.2e}".format(*cpu, *medians)
        lines.append(f"{kind:<22}{len(good):>5}{len(rows):>8}{numbers}")
    return lines


def table(study: dict) -> str:
    """Return the study as text."""
    line = "{0:<22}{1[converged]!s:>6}{1[iterations]:>6}{1[duration_s]:>7.3f}"
    line += "{1[objective]:>11.2e}{1[solve_cpu_s]:>9.2f}"
    line += "{1[open_loop_attitude_error_deg]:>10.4f}{1[energy_J]:>9.4f}{1[peak_power_W]:>8.3f}"
    head = (
        "plan                   conv.    it  T [s]  objective  cpu [s]  err [deg]    E [J]   P [W]"
    )
    lines = [head, line.format("(1, 3), Sect. 4.2", study["righting"])]
    for r in study["segments"]["rows"]:
        tail = name(r["segments"], r["links"])
        lines += [line.format(f"{tail} {kind}", r[kind]) for kind in ("paper", "ours") if kind in r]
    for kind, rows in study["frequencies"].items():
        lines += [line.format(f"{r['frequency']} Hz, {kind}", r) for r in rows]
    lines += ["", *rate_lines(study["rates"])]
    return "\n".join(lines)


def righted(folder: Path, starts: int) -> None:
    """Compute the missing parts of the study, and write its summary and figures."""
    hashes, kinds, program = built(folder), blocks(starts), digest(*(ROOT / s for s in SOURCES))
    wanted = {"Sect. 4.2": (RAT, {}, plans.section_4_2)} | examples() | segments()
    for parts in kinds.values():
        wanted |= parts
    parts = {
        title: Part(make, {"model": hashes[size], "program": program, "settings": settings})
        for title, (size, settings, make) in wanted.items()
    }
    found = made("righting", folder / "parts", parts)
    draw_flights(folder, found)
    study = summary(found, kinds)
    draw_figure_11(study["frequencies"], folder / "fig11.png")
    draw_rates(study["rates"], folder / "rates.png")
    (folder / "summary.json").write_text(json.dumps(study, indent=1) + "\n")
    print(table(study))
    print(f"\nwritten: fig9 to fig13, rates.png and summary.json in {folder}")

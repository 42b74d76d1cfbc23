"""The parts of the righting study, and the use of their results."""

import json
from functools import partial
from pathlib import Path

from examples import righting
from examples.front import ROOT
from examples.studies import righting_kinds as kinds
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
MORE = ((4, 2), (5, 2), (6, 2), (1, None), (2, None), (3, None), (4, None))
SOURCES = (
    "examples/righting.py",
    "examples/paper",
    "examples/studies/righting_paper.py",
    "examples/studies/righting_plans.py",
    "examples/studies/righting_kinds.py",
    "runtime",
)


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
        steps = round(frequency * righting.FLIGHT)
        makes = {"paper": partial(plans.paper_example, steps + 1)}
        makes["ours"] = partial(plans.example, max(2, steps // 3))
        for way, make in makes.items():
            parts[f"Fig. 11 {way} {frequency} Hz"] = RAT, {"frequency": frequency}, make
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


def summary(found: dict, starts: int) -> dict:
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
    rates = kinds.rows_of(starts, found)
    told = {"righting": found["Sect. 4.2"]["row"], "frequencies": frequencies}
    return told | {"segments": {"rows": rows}, "rates": rates}


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
    lines += ["", *kinds.table(study["rates"])]
    return "\n".join(lines)


def study(folder: Path, starts: int) -> None:
    """Compute the missing parts of the study, and write its summary and figures."""
    hashes, program = built(folder), digest(*(ROOT / s for s in SOURCES))

    def of(size: tuple) -> dict:
        return {"model": hashes[size], "program": program}

    wanted = {"Sect. 4.2": (RAT, {}, plans.section_4_2)} | examples() | segments()
    parts = {
        title: Part(make, of(size) | {"settings": settings})
        for title, (size, settings, make) in wanted.items()
    }
    found = made("righting", folder / "parts", parts | kinds.parts(starts, of))
    draw_flights(folder, found)
    study = summary(found, starts)
    draw_figure_11(study["frequencies"], folder / "fig11.png")
    draw_rates(study["rates"], folder / "rates.png")
    (folder / "summary.json").write_text(json.dumps(study, indent=1) + "\n")
    print(table(study))
    print(f"\nwritten: fig9 to fig13, rates.png and summary.json in {folder}")

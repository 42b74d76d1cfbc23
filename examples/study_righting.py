"""Airborne righting (Sects. 4.2, 4.3): paper's problem and tails go in; Figs. 9 to 13, Table 2 and rates come out.

Usage: python examples/study_righting.py [FOLDER] [--starts 200], by default output/studies/righting
"""

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np

import righting
import serpentail as st
from study_righting_figures import draw_figure_10, draw_figure_11, draw_figure_13, draw_rates

FREQUENCIES = (20, 40, 60, 80, 100, 150, 200)  # Hz, nodes a second
EXAMPLE = 4  # the random start of Fig. 11: both ways of planning converge on it
TAILS = ((1, 6), (2, 3), (3, 2))
MORE = ((4, 2), (5, 2), (6, 2), (1, None), (2, None), (3, None))
SEVERAL = ((2, 3), (3, 2), (6, 2), (1, None), (3, None))  # tails righted from random starts, besides (1, 3)
FEWER = 4  # times fewer starts for these


def say(words: str) -> None:
    """Tell on stderr what is going on."""
    print(f"  {words}", file=sys.stderr, flush=True)


def righted(folder: Path, rat: st.Model) -> dict:
    """Sect. 4.2: plan from the kick's state within 0.58 s; draw Figs. 9 and 10."""
    start, limits = righting.kicked(rat), righting.bounds(rat)
    plan = st.plan(rat, start=start, duration=(0.3, righting.FLIGHT), bounds=limits, retries=8, tolerance=0.01)
    flights = {"planned": plan.trajectory, "tracked": righting.tracked(rat, plan)}
    flights["passive"] = righting.passive(rat, start, plan.duration)
    for name, flight in flights.items():
        com = righting.centre_of_mass(rat, flight)
        st.filmstrip(flight, rat.tail_points(flight.q), folder / f"fig9_{name}.png", com=com)
    draw_figure_10(flights, folder / "fig10.png")
    errors = flights["tracked"].resample(np.clip(plan.trajectory.t, 0, flights["tracked"].t[-1])).tail
    deviation = errors - plan.trajectory.tail
    return righting.row(plan) | {"mean_rad": deviation.mean(axis=0).tolist(), "std_rad": deviation.std(axis=0).tolist()}


def frequencies(rat: st.Model) -> dict:
    """Fig. 11: what more nodes cost and bring, as the paper plans and as we do, on one random start."""
    start, rows = righting.tumbling(rat, EXAMPLE), {"paper": [], "ours": []}
    for frequency in FREQUENCIES:
        nodes = round(frequency * righting.FLIGHT)
        both = {"paper": righting.PAPER | {"intervals": nodes}}
        both["ours"] = {"intervals": max(2, nodes // 3), "tolerance": None, "retries": 0}
        for name, settings in both.items():
            plan = st.plan(rat, start=start, duration=righting.FLIGHT, bounds=righting.bounds(rat), **settings)
            rows[name].append({"frequency": frequency} | righting.row(plan))
    return rows


def segments(folder: Path, models: dict) -> dict:
    """Sect. 4.3: tails of six links, from the kick's state, as the paper plans (100 Hz) and true."""
    rows, plans = [], {}
    for (m, n), rat in models.items():
        say(name(m, n))
        common = {"start": righting.kicked(rat), "bounds": righting.bounds(rat, 2 * np.pi)}
        true = st.plan(rat, **common, duration=(0.3, righting.FLIGHT), retries=8)
        rows.append({"segments": m, "links": n, "ours": righting.row(true)})
        if (m, n) in TAILS:
            paper = st.plan(rat, **common, duration=righting.FLIGHT, **righting.PAPER, intervals=58)
            rows[-1]["paper"] = righting.row(paper)
            plans[m, n] = true
            com = righting.centre_of_mass(rat, true.trajectory)
            points = rat.tail_points(true.trajectory.q)
            st.filmstrip(true.trajectory, points, folder / f"fig12_m{m}_n{n}.png", com=com)
    draw_figure_13(plans, folder / "fig13.png")
    return {"rows": rows}


def rates(models: dict, count: int) -> dict[str, list[dict]]:
    """What plans from random tumbling starts come to, upright and at rest unless told otherwise."""
    free, kinds = st.Goal(torso_rate=None), {"(1, 3)": ((1, 3), count, {})}
    kinds["(1, 3), any rate"] = (1, 3), count, {"goal": free}
    kinds["(1, 3), no smoothing"] = (1, 3), count // FEWER, {"smoothing": 0.0}
    kinds |= {name(*size): (size, count // FEWER, {}) for size in SEVERAL}
    return {kind: rate(kind, models[size], starts, own) for kind, (size, starts, own) in kinds.items()}


def name(segments: int, links: int | None) -> str:
    """Return a tail's name."""
    return f"({segments}, {links})" if links else f"continuum {segments}"


def rate(kind: str, rat: st.Model, count: int, settings: dict) -> list[dict]:
    """Return a row for every start; the whole tail bends by 180 degrees as in Sect. 4.2, or by 360 as in 4.3."""
    say(f"{kind}: {count} random starts")
    turn = np.pi if (rat.segments, rat.links) == (1, 3) else 2 * np.pi
    settings = settings | {"duration": (0.3, righting.FLIGHT), "bounds": righting.bounds(rat, turn), "track": False}
    rows = []
    for k in range(1, count + 1):
        begun = time.process_time()
        plan = st.plan(rat, start=righting.tumbling(rat, k), **settings)
        rows.append(righting.row(plan) | {"start": k, "cpu_s": time.process_time() - begun})
    return rows


def rate_lines(rates: dict[str, list[dict]]) -> list[str]:
    """Return the rates as text: successes, medians and tails of CPU time, error and objective."""
    lines = ["random starts          true      of  cpu: median    95 %   most [s]  err [deg]  objective"]
    for kind, rows in rates.items():
        good = [r for r in rows if r["success"]]
        cpu = np.percentile([r["cpu_s"] for r in rows], [50, 95, 100])
        medians = [np.median([r[key] for r in good]) for key in ("open_loop_attitude_error_deg", "objective")]
        numbers = "{:>12.2f}{:>8.2f}{:>11.2f}{:>11.4f}{:>11.2e}".format(*cpu, *medians)
        lines.append(f"{kind:<22}{len(good):>5}{len(rows):>8}{numbers}")
    return lines


def table(study: dict) -> str:
    """Return the study as text."""
    line = (
        "{0:<22}{1[converged]!s:>6}{1[iterations]:>6}{1[duration_s]:>7.3f}{1[objective]:>11.2e}{1[solve_cpu_s]:>9.2f}"
    )
    line += "{1[open_loop_attitude_error_deg]:>10.4f}{1[energy_J]:>9.4f}{1[peak_power_W]:>8.3f}"
    head = "plan                   conv.    it  T [s]  objective  cpu [s]  err [deg]    E [J]   P [W]"
    lines = [head, line.format("(1, 3), Sect. 4.2", study["righting"])]
    for r in study["segments"]["rows"]:
        tail = name(r["segments"], r["links"])
        lines += [line.format(f"{tail} {kind}", r[kind]) for kind in ("paper", "ours") if kind in r]
    for kind, rows in study["frequencies"].items():
        lines += [line.format(f"{r['frequency']} Hz, {kind}", r) for r in rows]
    lines += ["", *rate_lines(study["rates"])]
    return "\n".join(lines)


def main(folder: Path, starts: int) -> None:
    """Do the study and write its summary and figures."""
    (folder / "generated").mkdir(parents=True, exist_ok=True)
    say("generate and compile")
    rat = righting.model(folder / "generated", 1, 3)
    models = {size: righting.model(folder / "generated", *size) for size in (*TAILS, *MORE)}
    say("Sect. 4.2")
    study = {"righting": righted(folder, rat)}
    say("Fig. 11")
    study["frequencies"] = frequencies(rat)
    draw_figure_11(study["frequencies"], folder / "fig11.png")
    say("Sect. 4.3")
    study["segments"] = segments(folder, models)
    study["rates"] = rates(models | {(1, 3): rat}, starts)
    draw_rates(study["rates"], folder / "rates.png")
    (folder / "summary.json").write_text(json.dumps(study, indent=1) + "\n")
    print(table(study))
    print(f"\nwritten: fig9 to fig13, rates.png and summary.json in {folder}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=righting.ROOT / "output" / "studies" / "righting")
    parser.add_argument("--starts", type=int, default=200)
    given = parser.parse_args()
    try:
        main(given.folder.absolute(), given.starts)
    except st.SerpentailError as error:
        sys.exit(str(error))

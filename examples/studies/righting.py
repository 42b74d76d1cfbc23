"""Airborne righting (Sects. 4.2, 4.3): the paper's Figs. 9 to 13 and Table 2, and ours.

Parts that were made once are kept in FOLDER/parts: a second run draws at once, one that was stopped
goes on.
Usage: python -m examples.studies.righting [FOLDER] [--starts 200], by default
output/studies/righting
"""

import argparse
import json
import time
from functools import partial
from pathlib import Path

import numpy as np

import serpentail as st
from examples import righting
from examples.studies.parts import as_flight, as_lists, digest, part, planned, run, say
from examples.studies.righting_figures import (
    draw_figure_10,
    draw_figure_11,
    draw_figure_13,
    draw_rates,
)

FREQUENCIES = (20, 40, 60, 80, 100, 150, 200)  # Hz, nodes a second
EXAMPLE = 4  # the random start of Fig. 11: both ways of planning converge on it
RAT = (1, 3)
TAILS = ((1, 6), (2, 3), (3, 2))
MORE = ((4, 2), (5, 2), (6, 2), (1, None), (2, None), (3, None))
SEVERAL = ((2, 3), (3, 2), (1, None), (3, None))  # tails righted from random starts, besides (1, 3)
FEWER = 16  # times fewer starts for these
BLOCK = 10  # random starts that are kept together
LIMIT = 300.0  # s a plan


def name(segments: int, links: int | None) -> str:
    """Return a tail's name."""
    return f"({segments}, {links})" if links else f"continuum {segments}"


def models(folder: Path) -> dict[tuple, st.Model]:
    """Generate, where that was not done, and load the tails."""
    of, found = (
        {"generator": digest(righting.ROOT / "codegen"), "functions": righting.FUNCTIONS},
        {},
    )
    for size in (RAT, *TAILS, *MORE):
        make = partial(_content, folder, *size)
        part(folder / "kept" / f"model {name(*size)}.json", of, make)
        found[size] = righting.loaded(folder, *size)
    return found


def _content(folder: Path, segments: int, links: int | None) -> str:
    return righting.model(folder, segments, links).manifest["content_hash"]


class Study:
    """Where the parts of the study are kept, and what all of them depend on."""

    def __init__(self, folder: Path, rats: dict[tuple, st.Model]):
        self.folder, self.rats = folder, rats
        self.program = digest(righting.ROOT / "runtime", Path(righting.__file__), Path(__file__))

    def part(self, title: str, size: tuple, settings: dict, make) -> dict | list:
        """Return a part about one tail."""
        of = {
            "model": self.rats[size].manifest["content_hash"],
            "program": self.program,
            "settings": settings,
        }
        return part(self.folder / "parts" / f"{title}.json", of, make)

    def film(self, size: tuple, flight: st.Trajectory, title: str) -> None:
        """Draw a strip of pictures of a flight."""
        flight.filmstrip(self.folder / f"{title}.png", model=self.rats[size])


def righted(study: Study) -> dict:
    """Sect. 4.2: plan from the kick's state within 0.58 s; draw Figs. 9 and 10."""
    found = study.part("Sect. 4.2", RAT, {}, partial(_righted, study.rats[RAT]))
    flights = {kind: as_flight(lists) for kind, lists in found["flights"].items()}
    for kind, flight in flights.items():
        study.film(RAT, flight, f"fig9_{kind}")
    draw_figure_10(flights, RAT[1], study.folder / "fig10.png")
    return found["row"]


def _righted(rat: st.Model) -> dict:
    start, limits = righting.kicked(rat), righting.bounds(rat)
    plan = planned(
        rat,
        start=start,
        duration=(0.3, righting.FLIGHT),
        bounds=limits,
        retries=8,
        time_limit=LIMIT,
    )
    flights = {"planned": plan.trajectory, "tracked": righting.tracked(rat, plan)}
    flights["passive"] = righting.passive(rat, start, plan.duration)
    at = np.clip(plan.trajectory.t, 0, flights["tracked"].t[-1])
    deviation = flights["tracked"].resample(at).tail - plan.trajectory.tail
    row = righting.row(plan) | {
        "mean_rad": deviation.mean(axis=0).tolist(),
        "std_rad": deviation.std(axis=0).tolist(),
    }
    return {"row": row, "flights": {kind: as_lists(flight) for kind, flight in flights.items()}}


def frequencies(study: Study) -> dict:
    """Fig. 11: what more nodes cost and bring, as the paper plans and as we do, on one random
    start.
    """
    rows = {"paper": [], "ours": []}
    for frequency in FREQUENCIES:
        nodes = round(frequency * righting.FLIGHT)
        both = {"paper": righting.PAPER | {"intervals": nodes}}
        both["ours"] = {"intervals": max(2, nodes // 3), "tolerance": None, "retries": 0}
        for way, settings in both.items():
            make = partial(_example, study.rats[RAT], settings)
            row = study.part(f"Fig. 11 {way} {frequency} Hz", RAT, settings, make)
            rows[way].append({"frequency": frequency} | row)
    return rows


def _example(rat: st.Model, settings: dict) -> dict:
    common = {"start": righting.tumbling(rat, EXAMPLE), "bounds": righting.bounds(rat)}
    return righting.row(
        planned(rat, duration=righting.FLIGHT, time_limit=LIMIT, **common, **settings)
    )


def segments(study: Study) -> dict:
    """Sect. 4.3: tails of six links, from the kick's state, as the paper plans (100 Hz) and
    true.
    """
    rows, flights = [], {}
    for size in (*TAILS, *MORE):
        rat = study.rats[size]
        true = study.part(f"Sect. 4.3 {name(*size)}", size, {}, partial(_true, rat))
        rows.append({"segments": size[0], "links": size[1], "ours": true["row"]})
        if size in TAILS:
            rows[-1]["paper"] = study.part(
                f"Sect. 4.3 {name(*size)} paper", size, {}, partial(_paper, rat)
            )
            flights[size] = as_flight(true["flight"])
            study.film(size, flights[size], f"fig12_m{size[0]}_n{size[1]}")
    draw_figure_13(flights, study.rats, study.folder / "fig13.png")
    return {"rows": rows}


def _true(rat: st.Model) -> dict:
    start, limits = righting.kicked(rat), righting.bounds(rat, 2 * np.pi)
    plan = planned(
        rat,
        start=start,
        bounds=limits,
        duration=(0.3, righting.FLIGHT),
        retries=8,
        time_limit=LIMIT,
    )
    return {"row": righting.row(plan), "flight": as_lists(plan.trajectory)}


def _paper(rat: st.Model) -> dict:
    start, limits = righting.kicked(rat), righting.bounds(rat, 2 * np.pi)
    plan = planned(
        rat,
        start=start,
        bounds=limits,
        duration=righting.FLIGHT,
        **righting.PAPER,
        intervals=58,
        time_limit=LIMIT,
    )
    return righting.row(plan)


def rates(study: Study, count: int) -> dict[str, list[dict]]:
    """What plans from random tumbling starts come to, upright and at rest unless told otherwise."""
    fewer, kinds = max(1, count // FEWER), {"(1, 3)": (RAT, count, {})}
    kinds["(1, 3), any rate"] = RAT, count, {"goal": st.Goal(torso_rate=None)}
    kinds["(1, 3), no smoothing"] = RAT, fewer, {"smoothing": 0.0}
    kinds |= {name(*size): (size, fewer, {}) for size in SEVERAL}
    return {kind: rate(study, kind, *given) for kind, given in kinds.items()}


def rate(study: Study, kind: str, size: tuple, count: int, settings: dict) -> list[dict]:
    """Return a row for every start; the whole tail bends by 180 degrees as in Sect. 4.2, or by 360
    as in 4.3.
    """
    rat, rows = study.rats[size], []
    turn = np.pi if size == RAT else 2 * np.pi
    limits = {
        "duration": (0.3, righting.FLIGHT),
        "bounds": righting.bounds(rat, turn),
        "track": False,
        "time_limit": LIMIT,
    }
    told = {key: repr(value) for key, value in settings.items()}
    for first in range(1, count + 1, BLOCK):
        starts = range(first, min(first + BLOCK, count + 1))
        title = f"{kind} starts {first} to {starts[-1]}"
        rows += study.part(title, size, told, partial(_block, rat, starts, settings | limits))
    say(f"{kind}: {sum(r['success'] for r in rows)} true plans of {count} random starts")
    return rows


def _block(rat: st.Model, starts: range, settings: dict) -> list[dict]:
    rows = []
    for k in starts:
        begun = time.process_time()
        plan = planned(rat, start=righting.tumbling(rat, k), **settings)
        rows.append(righting.row(plan) | {"start": k, "cpu_s": time.process_time() - begun})
    return rows


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


def main(folder: Path, starts: int) -> None:
    """Do what of the study is not kept yet, and write its summary and figures."""
    say("generate and compile")
    study = Study(folder, models(folder / "generated"))
    found = {
        "righting": righted(study),
        "frequencies": frequencies(study),
        "segments": segments(study),
    }
    draw_figure_11(found["frequencies"], folder / "fig11.png")
    found["rates"] = rates(study, starts)
    draw_rates(found["rates"], folder / "rates.png")
    (folder / "summary.json").write_text(json.dumps(found, indent=1) + "\n")
    print(table(found))
    print(f"\nwritten: fig9 to fig13, rates.png and summary.json in {folder}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "folder", nargs="?", type=Path, default=righting.ROOT / "output" / "studies" / "righting"
    )
    parser.add_argument("--starts", type=int, default=200)
    given = parser.parse_args()
    run(main, given.folder.absolute(), given.starts)

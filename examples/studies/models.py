"""The parts of the study of tail models: one for each tail, and the run times of all."""

import json
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks import timing
from benchmarks.models import built, timed_function
from examples.front import ROOT
from examples.studies.models_figures import draw_cost, draw_figure_8
from examples.studies.models_motion import SHOWN, STEPS, THIN, yaw_motion
from examples.studies.parts import Part, digest, made

LINKS = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 16, 24, 32, 64, 128, 256)
FUNCTIONS = ["mass_matrix", "forward_dynamics"]
ROUNDS, CALLS = 300, 256
SOURCES = ("codegen", "runtime", "examples/studies/models_motion.py")
WORDS = {
    "yaw": "deg, torso's final yaw in the motion of Sect. 4.1, starting at 0",
    "ns": "least time of one forward dynamics call from C",
    "difference": (
        "deg, articulated less continuum; links have the inertia of their ellipsoids, as in the "
        "paper: with many links it tends to -0.003, as these keep their thickness and a continuum "
        "has none"
    ),
    "thin_difference": (
        "deg, the same for links without inertia of their own: it tends to 0 like 1/n"
    ),
    "motion": "deg, yaw at the times of `time`, which is t/T: the duration T changes nothing",
}


def motion(links: int | None) -> dict:
    """Return a tail's part of Fig. 8, and how its forward dynamics is emitted."""
    model = built(1, links, functions=FUNCTIONS)
    found = {"motion": yaw_motion(model).tolist()}
    if links:
        thin = yaw_motion(model.with_parameters(link_inertia=THIN))
        emission = model.manifest["functions"]["forward_dynamics"]["emission"]
        found |= {"thin_yaw": thin[-1], "emission": emission}
    return found


def run_times() -> list[float]:
    """Return the least ns of one forward dynamics call: of the continuum, then of LINKS."""
    with TemporaryDirectory() as folder:
        tails = [built(1, links, functions=FUNCTIONS) for links in (None, *LINKS)]
        timed = [timed_function(tail, Path(folder)) for tail in tails]  # whose memory the calls use
        states = timing.random_states(1)
        times = timing.time_rounds([each.closure for each in timed], states, ROUNDS, CALLS)
        return times


def measured(folder: Path) -> dict:
    """Return yaw, differences and run times of all tails as plain numbers, the contents of
    summary.json.
    """
    of = {"program": digest(Path(__file__), *(ROOT / source for source in SOURCES))}
    titles = {links: f"links {links}" if links else "continuum" for links in (None, *LINKS)}
    parts = {title: Part(partial(motion, links), of) for links, title in titles.items()}
    moved = made("tails", folder / "parts", dict(reversed(parts.items())))  # the longest first
    # timed alone, because other processes would disturb
    ns = made("timing", folder / "parts", {"times": Part(run_times, of)})["times"]
    yaw = moved["continuum"]["motion"][-1]
    rows = [row(n, moved[titles[n]], yaw) | {"ns": t} for n, t in zip(LINKS, ns[1:], strict=True)]
    return {
        "words": WORDS,
        "time": np.linspace(0, 1, STEPS + 1).tolist(),
        "continuum": {"yaw": yaw, "ns": ns[0], "motion": moved["continuum"]["motion"]},
        "articulated": rows,
        "motion_of_4_links": moved[titles[SHOWN]]["motion"],
    }


def row(links: int, moved: dict, continuum_yaw: float) -> dict:
    """Return the contribution of one articulated tail to Fig. 8b."""
    yaw, thin = moved["motion"][-1], moved["thin_yaw"]
    differences = {"difference": yaw - continuum_yaw, "thin_difference": thin - continuum_yaw}
    return {"links": links, "yaw": yaw} | differences | {"emission": moved["emission"]}


def table(study: dict) -> str:
    """Return the study as text."""
    arc = study["continuum"]
    lines = [
        f"continuum: final yaw {arc['yaw']:.3f} deg, forward dynamics {arc['ns']:.0f} ns",
        "",
        "     n   final yaw   less continuum, deg      forward dynamics",
        "               deg   as built  thin links     ns  of continuum",
    ]
    for r in study["articulated"]:
        differences = f"{r['difference']:9.4f}   {r['thin_difference']:9.4f}"
        lines.append(
            f"{r['links']:6d}   {r['yaw']:9.3f}  {differences}  {r['ns']:5.0f}   "
            f"{r['ns'] / arc['ns']:9.2f}x"
        )
    return "\n".join(lines)


def study(folder: Path) -> None:
    """Compute the missing parts of the study, and write its summary and figures."""
    found = measured(folder)
    (folder / "summary.json").write_text(json.dumps(found, indent=1) + "\n")
    draw_figure_8(found, folder / "fig8.png")
    draw_cost(found, folder / "cost_against_difference.png")
    print(table(found))
    print(f"\nwritten: fig8.png, cost_against_difference.png and summary.json in {folder}")

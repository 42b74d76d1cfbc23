"""The paper's comparison of tail models (Sect. 4.1): one motion by both tails, Fig. 8 and its cost.

Usage: python -m examples.studies.models [FOLDER], by default output/studies/models
"""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import serpentail as st
from benchmarks.fixtures import Fixture, fixture
from benchmarks.peers import build, timing
from examples.studies.models_figures import draw_cost, draw_figure_8
from examples.studies.parts import run

ROOT = Path(__file__).resolve().parents[2]
LINKS = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 16, 24, 32, 64, 128, 256)
SHOWN = 4  # links of the tail in Fig. 8a, the one that differs most
STEPS = 400
FULL_TURN = np.arctan(np.pi / 2)  # rad, COM direction of an arc bent by pi
MOST_BEND = 1.5 * np.pi  # rad, more than any tail needs for it
THIN = (0.0, 0.0, 0.0)  # kg m^2, links that are lines, as the continuum is
ROUNDS, CALLS = 300, 256
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


def com_directions(steps: int = STEPS) -> np.ndarray:
    """Return the tail COM's direction theta_com (steps + 1,), rad, at equal times: 0 to atan(pi /
    2), a cubic.
    """
    s = np.linspace(0, 1, steps + 1)
    return FULL_TURN * (3 * s**2 - 2 * s**3)


def arc_direction(bend: np.ndarray) -> np.ndarray:
    """Return theta_com (rad) of an arc bent by `bend` (rad), Eq. 49."""
    return np.arctan2(bend - np.sin(bend), 1 - np.cos(bend))


def chain_direction(bend: np.ndarray, links: int) -> np.ndarray:
    """Return theta_com (rad) of equal links that are bent by `bend` (rad) in all, each by bend /
    n.
    """
    angles = np.multiply.outer(bend, np.arange(1, links + 1) / links)
    reach = (
        links + 0.5 - np.arange(1, links + 1)
    )  # how often a link counts: in itself half, in each one after it
    return np.arctan2(np.sin(angles) @ reach, np.cos(angles) @ reach)


def bend_towards(direction: Callable, targets: np.ndarray) -> np.ndarray:
    """Return the bends (rad) whose COM directions are the targets (rad), by bisection."""
    low, high = np.zeros_like(targets), np.full_like(targets, MOST_BEND)
    for _ in range(60):
        middle = (low + high) / 2
        short = direction(middle) < targets
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    return (low + high) / 2


def yaw_motion(model: st.Model) -> np.ndarray:
    """Return the torso's yaw phi_z (STEPS + 1,), deg, in Sect. 4.1's motion of a tail of one
    segment.
    """
    if model.links is None:
        return torso_yaw(model, bend_towards(arc_direction, com_directions()))
    bends = bend_towards(lambda bend: chain_direction(bend, model.links), com_directions())
    return torso_yaw(model, bends / model.links)


def torso_yaw(model: st.Model, angles: np.ndarray) -> np.ndarray:
    """Return the yaw (K,), deg, of a torso at zero momentum whose tail takes the yaw coordinates
    (K,), rad, in turn.

    Zero momentum is H_bb v_b + H_bt q_t_dot = 0 (upper rows of Eq. 1): the path alone matters, not
    its timing.
    """
    q = np.zeros((len(angles) - 1, model.nq))
    q[:, 3], q[:, 8] = 1.0, (angles[1:] + angles[:-1]) / 2
    H = model.mass_matrix(q)
    turns = -np.linalg.solve(H[:, :6, :6], H[:, :6, 7:8])[:, 3:, 0] * np.diff(angles)[:, None]
    attitude = [Rotation.identity()]
    for turn in turns:
        attitude.append(attitude[-1] * Rotation.from_rotvec(turn))
    q = np.zeros((len(angles), model.nq))
    q[:, 3:7] = [rotation.as_quat(scalar_first=True) for rotation in attitude]
    return np.degrees(st.pitch_roll_yaw(q)[:, 2])


def made(folder: Path, links: int | None) -> Path:
    """Generate one segment of so many links, or a continuum for None; return the generated
    folder.
    """
    name = f"articulated_m1_n{links}" if links else "continuum_m1"
    tail = ["--tail", "articulated", "--links", str(links)] if links else ["--tail", "continuum"]
    options = [
        "--segments",
        "1",
        "--functions",
        "mass_matrix,forward_dynamics",
        "--name",
        name,
        "--output",
        str(folder),
    ]
    subprocess.run(
        [sys.executable, "-m", "serpentail_codegen", *tail, *options],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return folder / name


def load_all(folder: Path) -> dict[int | None, Fixture]:
    """Generate, compile and load every tail; the key is its number of links, None for the
    continuum.
    """
    tails = {}
    for done, links in enumerate((None, *LINKS), 1):
        name = f"articulated, n = {links}" if links else "continuum"
        print(
            f"\r  generate and compile {done}/{len(LINKS) + 1}: {name:<24}",
            end="",
            file=sys.stderr,
            flush=True,
        )
        tails[links] = fixture(made(folder, links), folder)
    print(file=sys.stderr)
    return tails


def measure(tails: dict[int | None, Fixture]) -> dict:
    """Return yaw, differences and run times of all tails, in plain numbers: what summary.json
    holds.
    """
    print("  move and time", file=sys.stderr, flush=True)
    times = timing.time_rounds(
        [tail.closure for tail in tails.values()], timing.random_states(1), ROUNDS, CALLS
    )
    nanoseconds = {links: least for links, (least, _) in zip(tails, times, strict=True)}
    continuum = yaw_motion(tails[None].model)
    return {
        "words": WORDS,
        "time": np.linspace(0, 1, STEPS + 1).tolist(),
        "continuum": {"yaw": continuum[-1], "ns": nanoseconds[None], "motion": continuum.tolist()},
        "articulated": [row(tails[n].model, continuum[-1]) | {"ns": nanoseconds[n]} for n in LINKS],
        "motion_of_4_links": yaw_motion(tails[SHOWN].model).tolist(),
    }


def row(model: st.Model, continuum_yaw: float) -> dict:
    """Return what one articulated tail contributes to Fig. 8b, and how its forward dynamics is
    emitted.
    """
    yaw, thin = (yaw_motion(each)[-1] for each in (model, model.with_parameters(link_inertia=THIN)))
    emission = model.manifest["functions"]["forward_dynamics"]["emission"]
    differences = {"difference": yaw - continuum_yaw, "thin_difference": thin - continuum_yaw}
    return {"links": model.links, "yaw": yaw} | differences | {"emission": emission}


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


def main(folder: Path) -> None:
    """Do the study and write its summary and figures."""
    (folder / "generated").mkdir(parents=True, exist_ok=True)
    study = measure(load_all(folder / "generated"))
    (folder / "summary.json").write_text(json.dumps(study, indent=1) + "\n")
    draw_figure_8(study, folder / "fig8.png")
    draw_cost(study, folder / "cost_against_difference.png")
    print(table(study))
    print(f"\nwritten: fig8.png, cost_against_difference.png and summary.json in {folder}")


if __name__ == "__main__":
    try:
        given = sys.argv[1:] or [ROOT / "output" / "studies" / "models"]
        run(main, Path(given[0]).absolute())
    except build.PeerUnavailable as error:
        sys.exit(str(error))

"""The motions of the contact study: each is a part of it, from names to plain data and files."""

import json
from functools import partial
from pathlib import Path

import numpy as np

import serpentail as st
from examples.front import ROOT
from examples.studies.parts import Part, digest, made

SCENES = {  # the moments (s) that films show
    "kick": (0.0, 0.402, 0.41, 0.44, 0.55, 0.75, 0.95, 1.09),
    "tail_support_jump": (0.0, 0.402, 0.42, 0.5, 0.75, 1.0, 1.11, 1.5),
    "tail_support_jump_continuum": (0.0, 0.402, 0.42, 0.5, 0.75, 1.0, 1.11, 1.5),
    "self_recovery": (0.0, 0.25, 0.4, 0.5, 0.6, 0.7, 1.0, 1.3, 2.5),
    "self_recovery_continuum": (0.0, 0.25, 0.4, 0.5, 0.6, 0.75, 1.0, 1.3, 2.5),
}
PASSIVE = {"controller": {"kind": "damping", "damping": 1e-3}}
# Motions that must not succeed: the same with the tail through the ground, or with one that only
# damps.
CONTRASTS = {
    f"{scene}, {words}": (scene, without, changes)
    for scene in SCENES
    if scene != "kick"
    for words, without, changes in (
        ("tail through the ground", "tail", {}),
        ("passive tail", None, PASSIVE),
    )
}
SHOWN = (
    "take_off_s",
    "apex_m",
    "com_rise_m",
    "recontact_s",
    "pitch_at_end_rad",
    "upright_end",
    "standing_end",
)
SHOWN += ("landed", "peak_ground_force_N", "peak_ground_force_weights", "steps", "real_time_factor")
DROPS, DROPPED = 20, 3.0  # random drops, and for how long (s)
BLOCK = 5  # drops that are kept together
DRAWN = ("{}.npz", "{}_film.png", "{}_time.png")


def scene_file(scene: str, folder: Path, without: str) -> Path:
    """Write a scene without one of its groups of contacts; return its path."""
    text = (ROOT / "scenes" / f"{scene}.toml").read_text(encoding="utf-8")
    path = folder / "scenes" / f"{scene}_without_{without}.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text.replace(f', "{without}"', ""), encoding="utf-8")
    return path


def drawn(scene: str, folder: Path) -> dict:
    """Simulate, save and draw a scene's motion; return its summary."""
    found = st.scenario(scene)
    motion = found.simulate()
    motion.save(folder / f"{scene}.npz")
    motion.filmstrip(folder / f"{scene}_film.png", frames=SCENES[scene])
    motion.plot(path=folder / f"{scene}_time.png")
    return found.summary(motion)


def contrast(scene: str, without: str | None, changes: dict, folder: Path) -> dict:
    """Return the summary of a scene's motion with changes, or without one group of contacts."""
    found = st.scenario(scene_file(scene, folder, without) if without else scene, changes=changes)
    return found.summary(found.simulate())


def drops(seeds: list[int]) -> list[dict]:
    """Drop the animal from 0.15 m with random attitudes, bends and spins; return its final
    motion.
    """
    scene = st.scenario("self_recovery")
    return [drop(scene, seed) for seed in seeds]


def drop(scene: st.Scenario, seed: int) -> dict:
    """Return the final motion after one drop."""
    model, random = scene.model, np.random.default_rng(seed)
    weight = (model.parameters["torso_mass"] + model.parameters["tail_mass"]) * model.parameters[
        "gravity"
    ]
    q = np.concatenate(
        [[0, 0, 0.15], random.normal(size=4), random.uniform(-0.3, 0.3, 2 * model.segments)]
    )
    v = random.uniform(-3, 3, model.nv) * np.where(np.arange(model.nv) < 3, 0.1, 1)
    fall = st.simulate(
        model, q, v, controller=st.Damping(1e-3), legs=scene.legs, t_span=DROPPED, rtol=1e-5
    )
    forces = fall.contact.forces
    return {
        "seed": seed,
        "speed_m_s": float(np.linalg.norm(fall.v[-1, :3])),
        "load_over_weight": float(forces[-1, :, 2].sum() / weight),
        "steps": fall.info["steps"],
        "least_normal_force_N": float(forces[..., 2].min()),
        "cpu_s": fall.info["cpu_seconds"],
    }


def parts(folder: Path) -> dict[str, Part]:
    """Return the parts of the study: motions, those that must not succeed, and drops."""
    program = digest(ROOT / "runtime", ROOT / "codegen", Path(__file__))
    found = {}
    for scene in SCENES:
        text = (ROOT / "scenes" / f"{scene}.toml").read_text(encoding="utf-8")
        of, files = {"program": program, "scene": text}, [name.format(scene) for name in DRAWN]
        make = partial(drawn, scene, folder)
        found[scene] = Part(make, of, tuple(folder / name for name in files))
    for words, (scene, without, changes) in CONTRASTS.items():
        make = partial(contrast, scene, without, changes, folder)
        found[words] = Part(make, found[scene].of | {"without": without, "changes": changes})
    for first in range(0, DROPS, BLOCK):
        seeds = list(range(first, first + BLOCK))
        found[f"drops {first} to {seeds[-1]}"] = Part(
            partial(drops, seeds), found["self_recovery"].of
        )
    return found


def table(rows: dict[str, dict]) -> str:
    """Return summaries as a Markdown table."""
    lines = [f"| scene | {' | '.join(SHOWN)} |", "|---" * (len(SHOWN) + 1) + "|"]
    for name, row in rows.items():
        cells = [
            f"{x:.4g}" if isinstance(x, float) else str(x) for x in (row[key] for key in SHOWN)
        ]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def study(folder: Path) -> None:
    """Compute the missing parts of the study, compare them, and write its summary."""
    found = made("contact", folder / "parts", parts(folder))
    rows = {name: found[name] for name in (*SCENES, *CONTRASTS)}
    fallen = [row for title in found if title not in rows for row in found[title]]
    print(table(rows))
    slowest = max(row["speed_m_s"] for row in fallen)
    loads = [row["load_over_weight"] for row in fallen]
    carried = f"the ground carries {min(loads):.3f} to {max(loads):.3f} times the weight"
    print(f"{DROPS} random drops: after {DROPPED} s at most {slowest:.2g} m/s; {carried}")
    (folder / "contact.json").write_text(
        json.dumps({"scenes": rows, "drops": fallen}, indent=1), encoding="utf-8"
    )
    print(f"Films (*_film.png), plots (*_time.png), trajectories (*.npz), contact.json: {folder}")

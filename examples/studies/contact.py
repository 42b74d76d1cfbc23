"""The paper's motions on the ground (Sects. 4 and 4.4): films, plots and a table.

Usage: python -m examples.studies.contact [FOLDER], by default output/studies/contact
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

import serpentail as st
from examples.studies.parts import run

ROOT = Path(__file__).resolve().parents[2]
SCENES = {  # the moments (s) that films show
    "kick": (0.0, 0.402, 0.41, 0.44, 0.55, 0.75, 0.95, 1.09),
    "tail_support_jump": (0.0, 0.402, 0.42, 0.5, 0.75, 1.0, 1.11, 1.5),
    "tail_support_jump_continuum": (0.0, 0.402, 0.42, 0.5, 0.75, 1.0, 1.11, 1.5),
    "self_recovery": (0.0, 0.25, 0.4, 0.5, 0.6, 0.7, 1.0, 1.3, 2.5),
    "self_recovery_continuum": (0.0, 0.25, 0.4, 0.5, 0.6, 0.75, 1.0, 1.3, 2.5),
}
PASSIVE = {"controller": {"kind": "damping", "damping": 1e-3}}
# What must not stand: the same motions with the tail through the ground, and with one that only
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
SHOWN += ("landed", "peak_foot_force_N", "peak_ground_force_weights", "steps", "real_time_factor")
DROPS, DROPPED = 20, 3.0  # random drops, and for how long (s)


def generated(scene: str, folder: Path, without: str | None) -> tuple[Path, Path]:
    """Generate a scene, with one group of contacts less; return its file and folder."""
    text = (ROOT / "scenes" / f"{scene}.toml").read_text(encoding="utf-8")
    name = scene if without is None else f"{scene}_without_{without}"
    source = folder / "scenes" / f"{name}.toml"
    source.parent.mkdir(parents=True, exist_ok=True)
    source.write_text(text.replace(f', "{without}"', "") if without else text, encoding="utf-8")
    command = [
        sys.executable,
        "-m",
        "serpentail_codegen",
        str(source),
        "--output",
        str(folder / "generated"),
    ]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return source, folder / "generated" / name


def motion(scene: str, folder: Path, without: str | None = None, changes: dict | None = None):
    """Return a scenario, its motion and its summary."""
    found = st.scenario(*generated(scene, folder, without), changes)
    flight = found.simulate()
    return found, flight, found.summary(flight)


def drops(folder: Path) -> list[dict]:
    """Random attitudes, bends and spins, dropped from 0.15 m: what is left after a while."""
    source, made = generated("self_recovery", folder, None)
    scene = st.scenario(source, made)
    model, rows = scene.model, []
    weight = (model.parameters["torso_mass"] + model.parameters["tail_mass"]) * model.parameters[
        "gravity"
    ]
    for seed in range(DROPS):
        random = np.random.default_rng(seed)
        q = np.concatenate(
            [[0, 0, 0.15], random.normal(size=4), random.uniform(-0.3, 0.3, 2 * model.segments)]
        )
        v = random.uniform(-3, 3, model.nv) * np.where(np.arange(model.nv) < 3, 0.1, 1)
        fall = st.simulate(
            model, q, v, controller=st.Damping(1e-3), legs=scene.legs, t_span=DROPPED, rtol=1e-5
        )
        forces = fall.contact.forces
        rows.append({"seed": seed, "speed_m_s": float(np.linalg.norm(fall.v[-1, :3]))})
        rows[-1] |= {
            "load_over_weight": float(forces[-1, :, 2].sum() / weight),
            "steps": fall.info["steps"],
        }
        rows[-1] |= {"least_normal_force_N": float(forces[..., 2].min())}
        rows[-1] |= {"cpu_s": fall.info["cpu_seconds"]}
    return rows


def table(rows: dict[str, dict]) -> str:
    """Return summaries as a Markdown table."""
    lines = [f"| scene | {' | '.join(SHOWN)} |", "|---" * (len(SHOWN) + 1) + "|"]
    for name, row in rows.items():
        cells = [
            f"{x:.4g}" if isinstance(x, float) else str(x) for x in (row[key] for key in SHOWN)
        ]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main(folder: Path) -> None:
    """Simulate, draw, compare."""
    rows = {}
    for name, moments in SCENES.items():
        _, flight, rows[name] = motion(name, folder)
        flight.save(folder / f"{name}.npz")
        flight.filmstrip(folder / f"{name}_film.png", frames=moments)
        flight.plot(path=folder / f"{name}_time.png")
        print(f"{name}: {flight.info['steps']} steps, {rows[name]['cpu_s']:.3f} s", flush=True)
    for words, (name, without, changes) in CONTRASTS.items():
        rows[words] = motion(name, folder, without, changes)[2]
    fallen = drops(folder)
    print(table(rows))
    slowest = max(row["speed_m_s"] for row in fallen)
    loads = [row["load_over_weight"] for row in fallen]
    carried = f"{min(loads):.3f} to {max(loads):.3f} weights carried"
    print(f"{DROPS} random drops, after {DROPPED} s: at most {slowest:.2g} m/s, rolling; {carried}")
    (folder / "contact.json").write_text(
        json.dumps({"scenes": rows, "drops": fallen}, indent=1), encoding="utf-8"
    )
    print(f"Films (*_film.png), plots (*_time.png) and trajectories (*.npz): {folder}")


if __name__ == "__main__":
    given = sys.argv[1:] or [ROOT / "output" / "studies" / "contact"]
    run(main, Path(given[0]).absolute())

"""The main job on the paper's rat: it flies, kicks, rights itself by its tail, and is drawn."""

from __future__ import annotations  # those of serpentail would import it

import argparse
import os
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import serpentail as st
from serpentail.basics.files import refuse_unusable

ROOT = Path(__file__).resolve().parent.parent
SCENES = ("kangaroo_rat_m1_n3", "kangaroo_rat_m3_n4")
# The state 0.1 s after the kick: height (m), velocity (m/s), pitch (rad), spin (rad/s).
HEIGHT, VELOCITY, PITCH, SPIN = 0.34, (0.0, -0.302, 2.385), 3.80, 26.2
BEND, BEND_RATE = 3 * -0.558, 3 * 4.70  # rad, rad/s: of the whole tail, in pitch
FLIGHT = 0.58  # s, until shortly before landing
FRAME = 1e-3  # s, between samples
KICK = (0.0, 0.402, 0.41, 0.44, 0.55, 0.75, 0.95, 1.09)  # s, moments of the kick's film
MOMENTS = 7  # of the film of both tumbles
K_DMP = 1e-3  # N m s, the passive tail of the paper's Table 1


@contextmanager
def step(words: str):
    """Tell what is being done, then how long it took."""
    print(f"  {words:<52}", end="", flush=True)
    start = time.perf_counter()
    yield
    print(f"{time.perf_counter() - start:8.3f} s", flush=True)


def show(picture: Path) -> None:
    """Tell where a picture is, as soon as it is there."""
    print(f"  picture:          {os.path.relpath(picture)}", flush=True)


def start(model: st.Model) -> tuple:
    """Return q and v after the kick; every joint takes the same share of the tail's bend."""
    import numpy as np

    share = np.tile([1.0, 0.0], model.segments) / (model.segments * model.links)
    q = [0, 0, HEIGHT, np.cos(PITCH / 2), np.sin(PITCH / 2), 0, 0, *BEND * share]
    return np.array(q), np.array([*VELOCITY, SPIN, 0, 0, *BEND_RATE * share])


def drift(vectors) -> float:
    """Return the largest change of a vector (K, 3), relative to its start."""
    return abs(vectors - vectors[0]).max() / (vectors[0] ** 2).sum() ** 0.5


def report(model: st.Model, flight: st.Trajectory, check: st.Trajectory) -> str:
    """Return what the conservation laws and the other integrator say about a flight."""
    import numpy as np
    from scipy.integrate import simpson

    weight = model.parameters["gravity"] * (
        model.parameters["torso_mass"] + model.parameters["tail_mass"]
    )
    level = flight.linear_momentum + weight * flight.t[:, None] * [0, 0, 1]
    damped = simpson(-np.sum(flight.tau * flight.v[:, 6:], axis=1), x=flight.t)
    lost = flight.energy[0] - flight.energy[-1]
    turned = np.ptp(st.pitch_roll_yaw(flight.q, unwrap=True)[:, 0])
    rows = {
        "pitch": f"{turned:.2f} rad in {FLIGHT} s of flight",
        "speed": (
            f"{flight.info['steps']} steps of Tsit5, "
            f"{FLIGHT / flight.info['seconds']:.0f} times real time"
        ),
        "momentum": f"constant to {drift(level):.0e}, gravity's impulse taken off",
        "angular momentum": (
            f"constant to {drift(flight.angular_momentum):.0e}, about the centre of mass"
        ),
        "energy": f"{1e3 * lost:.4f} mJ less; the tail's damping took {1e3 * damped:.4f} mJ",
        "Tsit5 and DOP853": (
            f"differ by {np.abs(flight.q - check.q).max():.0e} at most (q, in m and rad)"
        ),
    }
    return "\n".join(f"  {name + ':':<18}{words}" for name, words in rows.items())


def fly(scene: str, folder: Path) -> None:
    """Do everything for one scene."""
    print(scene)
    with step("generate C and CasADi from the scene"):
        st.build(scene, compiled=False)
    with step("compile the C (or find it in the cache) and load"):
        model = st.build(scene)
    q, v = start(model)
    with step(f"simulate {FLIGHT} s of flight, Tsit5 in C"):
        flight = st.simulate(
            model, q, v, controller=st.Damping(K_DMP), t_span=FLIGHT, output_step=FRAME, rtol=1e-10
        )
    with step("simulate it again, SciPy's DOP853"):
        check = st.simulate(
            model,
            q,
            v,
            controller=st.Damping(K_DMP),
            t_span=FLIGHT,
            output_step=FRAME,
            method="dop853",
        )
    with step("draw and save"):
        flight.film(folder / f"{scene}_film.png")
        flight.plot(path=folder / f"{scene}_time.png")
        flight.save(folder / f"{scene}.npz")
    show(folder / f"{scene}_film.png")
    print(report(model, flight, check), end="\n\n")


def kick(folder: Path) -> None:
    """Settle, kick and land, as the scene's table [simulate] says."""
    print("kick")
    with step("generate C and CasADi from the scene"):
        st.build("kick", compiled=False)
    with step("compile the C (or find it in the cache), settle"):
        scene = st.scenario("kick")
    with step(f"simulate {scene.duration} s, implicit steps in C"):
        motion = scene.simulate()
    with step("draw and save"):
        motion.filmstrip(folder / "kick_film.png", frames=KICK)
        motion.save(folder / "kick.npz")
    show(folder / "kick_film.png")
    print("  in this scene only the feet touch the ground: tail and torso pass through it")
    told = scene.summary(motion)
    leap = "take-off {take_off_s:.3f} s, apex {apex_m:.3f} m, landing {recontact_s:.3f} s".format(
        **told
    )
    speed = "{steps} steps, {real_time_factor:.0f} times faster than real time".format(**told)
    print(
        f"  leap:             {leap} (paper: about 0.6 m, 1.08 s)\n  speed:            {speed}",
        end="\n\n",
    )


def righting(folder: Path) -> None:
    """Plan how the tail rights the tumbling rat, and compare with a tail that only damps."""
    from serpentail.basics.attitude import tilt_deg
    from serpentail.scenes.plan import planned

    print("righting_m1_n3")
    with step("generate C and CasADi from the scene"):
        st.build("righting_m1_n3", compiled=False)
    with step("plan the tail's torques"):
        plan = planned("righting_m1_n3")
    model, start = plan.trajectory.model, (plan.problem.q0, plan.problem.v0)
    with step(f"simulate {plan.duration:.2f} s with a passive tail"):
        passive = st.simulate(model, *start, controller=st.Damping(K_DMP), t_span=plan.duration)
    both, names = [passive, plan.trajectory], ["passive", "planned"]
    with step("draw both side by side"):
        look = {"frames": MOMENTS, "names": names, "views": ("side",)}
        st.filmstrip(both, folder / "righting_film.png", **look)
    with step("draw both as a moving film"):
        st.film(both, folder / "righting.gif", names=names)
    show(folder / "righting_film.png")
    ends = [tilt_deg(motion.attitude[-1]) for motion in both]
    print(
        f"  tilt at the end:  {ends[0]:.0f} deg with a passive, {ends[1]:.2f} deg with the planned"
        " tail",
        end="\n\n",
    )


def main(folder: Path) -> None:
    """Fly, kick, tumble and right; the model that is made soonest first, for an early picture."""
    small, large = SCENES
    fly(small, folder)
    kick(folder)
    righting(folder)
    fly(large, folder)
    print(
        f"Pictures (*_film.png, *_time.png), a film (righting.gif), trajectories (*.npz): {folder}"
    )


def arguments() -> argparse.Namespace:
    """Return the command line's arguments."""
    parser = argparse.ArgumentParser(description=__doc__)
    told = "where results go (default: output/demo of the checkout)"
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "output/demo", help=told)
    given = parser.parse_args()
    try:
        refuse_unusable(given.folder)
    except OSError as reason:
        parser.error(f"{str(given.folder)!r}: {reason}: give a folder that can be written to")
    return given


if __name__ == "__main__":
    wanted = arguments()
    try:
        main(wanted.folder.absolute())
    except st.SerpentailError as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        print("\ninterrupted", file=sys.stderr)
        sys.exit(130)

"""
The same jump, made for height, for softness and for little spin
=================================================================

``st.optimise`` searches for the moves of the legs: of the push, and of legs that
yield when they touch the ground. The flight between is planned. Within the same
limits, one thing can be made as good as it gets: the height of the jump, the
forces of push and landing, or the angular momentum that the push leaves.

This example needs CasADi: ``pip install "serpentail[plan]"``.
"""

from math import pi, radians

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

scene = st.scenario("kick_and_land")

# the tail ends up and at rest, and stays in its plane
goal = st.Goal(torso_rate=None, tail=[radians(-20), 0.0], tail_rate=[0.0, 0.0])
plan = {"goal": goal, "bounds": st.Bounds(angle=(pi / 3, 1e-3), torque=0.02)}

# first guesses by hand
push = {"at": 0.02, "gamma": 4.45, "delta": -0.96, "duration": 0.032, "shape": "accelerate"}
stretch = {"before_landing": 0.12, "gamma": 3.93, "delta": -1.13, "duration": 0.08}
soft = {"at": "touch_down", "gamma": 3.93, "delta": -0.35, "duration": 0.024}
phases = [
    st.Phase("push", 1.0, "airborne", 0.01, st.Damping(1e-3), moves=[push]),
    st.Phase("flight", 1.5, "landing", plan=plan, moves=[stretch]),
    st.Phase("land", 1.0, controller=st.Damping(5e-3), moves=[soft | {"shape": "decelerate"}]),
]
settings = {"rtol": 1e-5, "output_step": 1e-3}
leap = st.Sequence(scene.model, phases, radians(210), radians(-15), settings)

# %%
# Each leap keeps the limits: forces of 25 body weights and a tilt of 60 degrees.

limits = {"push": 25, "landing": 25, "tilt": "60 deg"}
start = scene.q0, scene.v0, scene.settings["bristles0"]
found = {
    best: st.optimise(leap, *start, limits=limits, goal={"rise": 0.25}, best=best)
    for best in ("rise", "softness", "spin")
}
for best, each in found.items():
    told = each.report["measures"]
    print(
        f"{best}: rises {100 * told['rise']:.0f} cm, pushes with {told['push']:.1f} and lands with "
        f"{told['landing']:.1f} body weights, spin {1e6 * told['spin']:.0f} mg m^2/s, "
        f"success: {each.success}"
    )

# %%
# A higher jump needs a stronger push and faster legs. The spin hardly differs: with
# little of it, just so much is left as turns the torso upright until it lands.

plt.style.use("seaborn-v0_8-colorblind")
figure, axes = plt.subplots(3, 1, figsize=(7, 6.4), sharex=True, layout="constrained")
for best, each in found.items():
    motion = each.run.trajectory
    upright = st.rotation_matrix(motion.q[:, 3:7])[:, 2, 2]
    weights = motion.contact.total / st.summary(scene.model, motion)["body_weight_N"]
    axes[0].plot(motion.t, 100 * motion.q[:, 2], label=best)
    axes[1].plot(motion.t, np.degrees(np.arccos(np.clip(upright, -1, 1))))
    axes[2].plot(motion.t, weights)
axes[0].set(ylabel="height (cm)", title="Three leaps within the same limits")
axes[0].legend(title="best")
axes[1].set(ylabel="tilt (deg)")
axes[2].set(ylabel="ground's force (BW)", xlabel="time (s)", xlim=(0, 1.2))

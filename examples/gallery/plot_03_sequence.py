"""
Jump, right, land
=================

The animal kicks, turns upright in the air by a planned swing of its tail, and
lands on its feet. This is one motion of three phases. The plan of the second
phase is made for the state in which the first phase ends.

This example needs CasADi: ``pip install "serpentail[plan]"``.
"""

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

scene = st.scenario("kick_and_land")
run = scene.sequence()
for phase in run.phases:
    print(f"{phase.name}: {phase.begin:.3f} s to {phase.end:.3f} s, ended by {phase.ended_by}")
print("landed on its feet:", st.summary(scene.model, run.trajectory)["landed"])

# %%
# The tilt is the angle between the back of the animal and the vertical: 0 degrees
# is upright, 180 degrees is upside down.

motion = run.trajectory
upright = st.rotation_matrix(motion.q[:, 3:7])[:, 2, 2]
tilt = np.degrees(np.arccos(np.clip(upright, -1, 1)))

plt.style.use("seaborn-v0_8-colorblind")
figure, axes = plt.subplots(3, 1, figsize=(7, 5.4), sharex=True, layout="constrained")
axes[0].plot(motion.t, motion.q[:, 2])
axes[0].set(
    ylabel="height (m)", title="A planned swing of the tail ends upright, just before the landing"
)
axes[1].plot(motion.t, tilt, color="C1")
axes[1].set(ylabel="tilt (deg)", yticks=[0, 90, 180])
axes[2].plot(motion.t, 1e3 * motion.tau, label=["pitch", "yaw"])
axes[2].set(ylabel="tail torque (mN m)", xlabel="time (s)")
axes[2].legend(loc="upper right", ncols=2)
for phase, shade in zip(run.phases, ["0.93", "0.85", "0.93"], strict=True):
    for ax in axes:
        ax.axvspan(phase.begin, phase.end, color=shade, linewidth=0)
    axes[0].text((phase.begin + phase.end) / 2, 0.3, phase.name, ha="center")
plt.show()

# %%
# Watch it. The marks on the time slider are touch-downs and take-offs.

motion

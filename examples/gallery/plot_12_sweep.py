"""
A sweep: which tail turns the body most?
========================================

A sweep runs a model at many points and keeps one row of results for each. Here an
animal falls without spin, and a constant torque swings its tail down for 0.1 s. How
far does the torso tilt, with tails of different mass and length?
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

model = st.build(tail="articulated", segments=1, links=3)
masses, lengths = np.linspace(1, 6, 11), np.linspace(80, 240, 11)  # g, mm
sweep = st.sweep(
    model,
    over={
        "tail_mass": st.grid([f"{mass:g} g" for mass in masses]),
        "tail_length": st.grid([f"{length:g} mm" for length in lengths]),
    },
    outputs=["tilt_end_deg"],
    settings={
        "q0": [0, 0, 1, 1, 0, 0, 0, 0, 0],
        "v0": np.zeros(8),
        "t_span": 0.1,
        "controller": st.TorqueTable([0.0, 0.1], [[-5e-4, 0], [-5e-4, 0]]),  # N m
    },
    store=Path(tempfile.mkdtemp(), "study.db"),
)
print(sweep.status())

# %%
# A second call with the same store finds all rows and runs nothing. In this sweep the
# torque is the same for all tails. A short, light tail gives way and moves fast, but
# it can push for a short time only; a long, heavy tail hardly moves in 0.1 s.

tilt = np.array([row["tilt_end_deg"] for row in sweep.rows()]).reshape(11, 11)
plt.style.use("seaborn-v0_8-colorblind")
figure, ax = plt.subplots(figsize=(7, 4.2), layout="constrained")
shades = ax.contourf(lengths, masses, tilt, 12, cmap="viridis")
figure.colorbar(shades, label="tilt of the torso after 0.1 s (deg)")
ax.set(xlabel="length of the tail (mm)", ylabel="mass of the tail (g)")
plt.show()

# %%
# The motion of one point of the sweep, made again:

sweep.motion(60)

"""
A sweep: which tail turns the body most?
========================================

A sweep runs a model at many points and keeps one row of results for each. Here an
animal falls without spin, and swings its tail down by 138 degrees in 0.2 s. How far
does the torso tilt, with tails of different mass and length?
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

model = st.build("righting_m1_n3")
swing = st.Reference([0, 0.2], [[0, 0], [-0.8, 0]])  # rad, of each of the three joints
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
        "t_span": 0.2,
        "controller": st.Pfl(model, swing),
    },
    store=Path(tempfile.mkdtemp(), "study"),
)
print(sweep.status())

# %%
# A second call with the same store finds all rows and runs nothing. The larger the
# moment of inertia of the tail, the further it turns the torso the other way.

tilt = np.array([row["tilt_end_deg"] for row in sweep.rows()]).reshape(11, 11)
figure, ax = plt.subplots(figsize=(7, 4.2), layout="constrained")
shades = ax.contourf(lengths, masses, tilt, np.arange(0, 50, 5), cmap="viridis")
figure.colorbar(shades, label="tilt of the torso after the swing (deg)")
ax.plot(195, 3.5, "w*", markersize=14)
ax.text(198, 3.6, "kangaroo rat", color="w")
ax.set(xlabel="length of the tail (mm)", ylabel="mass of the tail (g)")
ax.set_title("Long and heavy tails turn the torso most")
plt.show()

# %%
# The page *What a tail is worth* asks a larger question in the same way, with a plan at
# each point: how many tumbles does a tail right?
#
# .. image:: /images/morphology.png
#    :alt: Righted share, energy and duration against length, mass and taper of the tail
#
# Here is the motion of one point of our sweep.

sweep.motion(60)

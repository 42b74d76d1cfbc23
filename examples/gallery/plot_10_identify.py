"""
Body parameters from motion capture
===================================

Cameras see eight markers on an animal in flight. ``st.identify`` finds the mass,
length, stiffness and damping of the tail that explain the tracks best, and how
certain they are.

There is no recording in the package, so we make one from a body that we know: 200
frames a second, 0.5 mm of noise, one marker in ten hidden. The file stays in a
temporary folder; ``serpentail identify scenes/identify_tail.toml FILE`` reads it, too.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

model = st.build("identify_tail", purpose=["simulate"])  # besides [identify]
truth = {"tail_mass": 3.51e-3, "tail_length": 0.19466}
truth |= {"tail_stiffness": 2e-3, "tail_damping": 5e-5}
torso = {"nose": (0, 50, 10), "left": (-25, -20, 20), "right": (25, -20, 20), "back": (0, 0, 30)}
markers = {name: st.Marker(torso=1e-3 * np.array(place)) for name, place in torso.items()}
markers |= {f"tail{k}": st.Marker(tail=k / 4, offset=(0, 0, 3e-3)) for k in (1, 2, 3, 4)}

q0, v0 = [0, 0, 0.3, 1, 0, 0, 0, 0.4, -0.3], [0, 0.3, 1.5, 4, 2, -3, 5, 8]
flight = st.simulate(model.with_parameters(**truth), q0, v0, t_span=0.3, output_step=1 / 200)
rng = np.random.default_rng(20)
seen = st.marker_positions(flight.model, flight.q, markers)
seen += 5e-4 * rng.standard_normal(seen.shape)
seen[rng.random(seen.shape[:2]) < 0.1] = np.nan  # hidden
tracks = st.marker_tracks(flight.t, seen, list(markers), unit="m")
file = st.write_markers(tracks, Path(tempfile.mkdtemp(), "tail_markers.trc"))
print(file)

# %%
# Now forget the truth, and read the file. ``[same]`` asks for one number for all joints.

wanted = ["tail_mass", "tail_length", "tail_stiffness[same]", "tail_damping[same]"]
found = st.identify(model, st.read_markers(file), markers, wanted)
print(found.table)

# %%
# Each bar is a 95 % interval about the estimate, in per cent of the truth. The search
# began with the numbers of the scene, some of them far away.

figure, ax = plt.subplots(figsize=(7, 2.8), layout="constrained")
for k, (each, true) in enumerate(zip(found.parameters, truth.values(), strict=True)):
    numbers = np.array([each.low, each.value, each.high, each.begin])
    low, value, high, begin = 100 * (numbers / true - 1)
    ax.errorbar(value, k, xerr=[[value - low], [high - value]], fmt="o", capsize=4, color="C0")
    ax.plot(begin, k, "x", color="C1")
    ax.annotate("begin", (begin, k), (0, 5), textcoords="offset points", ha="center")
ax.grid(axis="x")
ax.set_yticks(range(4), ["mass", "length", "stiffness", "damping"])
ax.margins(y=0.2)
ax.set(
    xlabel="difference from the truth (%)",
    title="Eight markers determine the parameters of the tail",
)
plt.show()

# %%
# The motion that was found. ``found.view("page.html")`` adds the measured markers.

found.trajectory

"""
Which motion tells most about the tail?
=======================================

Before an experiment, one can ask which motion makes the parameters most certain.
Every candidate drives the tail with the same largest torque, at another frequency
and along another path. ``st.fisher_information`` predicts the standard deviations
that cameras would leave, without any recording.
"""

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

rat = st.build("identify_tail", purpose=["simulate"])  # besides [identify]
wanted = ["torso_mass", "torso_inertia", "tail_mass", "tail_stiffness[same]"]
wanted += ["tail_damping[same]"]
torso = {"nose": (0, 50, 10), "left": (-25, -20, 20), "right": (25, -20, 20), "back": (0, 0, 30)}
markers = {name: st.Marker(torso=1e-3 * np.array(place)) for name, place in torso.items()}
markers |= {f"tail{k}": st.Marker(tail=k / 4, offset=(0, 0, 3e-3)) for k in (1, 2, 3, 4)}

# %%
# Torques of 1 mN m at most, for 0.3 s of flight, seen by cameras at 200 Hz with 0.5 mm
# of noise. A path is the amplitude of pitch and yaw, and the lag between them.

paths = {"pitch": (1, 0, 0), "yaw": (0, 1, 0), "circle": (1, 1, 0.25)}
times, frequencies = np.linspace(0, 0.3, 601), [2, 4, 8, 16]
q0, v0 = [0, 0, 0.3, 1, 0, 0, 0, 0, 0], [0, 0, 1.5, 0, 0, 0, 0, 0]
flights, spread = {}, {}
for path, (pitch, yaw, lag) in paths.items():
    for frequency in frequencies:
        turns = 2 * np.pi * (frequency * times[:, None] + [0, lag])
        wave = st.TorqueTable(times, 1e-3 * np.array([pitch, yaw]) * np.sin(turns))
        flight = st.simulate(rat, q0, v0, controller=wave, t_span=0.3, output_step=5e-4)
        told = st.fisher_information(rat, flight, markers, wanted, noise=5e-4, rate=200.0)
        flights[path, frequency] = flight
        spread[path, frequency] = 100 * told.std["tail_mass"] / rat.parameters["tail_mass"]
        print(f"{path:<7}{frequency:>3} Hz: D-optimality {told.d_optimality:6.1f}")

# %%
# D-optimality is the logarithm of the determinant of the information: the larger, the
# more certain are all parameters together. Swings in pitch alone turn the torso about
# one axis only, so they leave two of its moments of inertia undetermined (-inf). For
# all parameters together a circle at 2 Hz is best; for the mass alone, one at 4 Hz.

plt.style.use("seaborn-v0_8-colorblind")
figure, ax = plt.subplots(figsize=(7, 3.6), layout="constrained")
for path, marker in zip(paths, "os^", strict=True):
    each = [spread[path, frequency] for frequency in frequencies]
    size = 9 if path == "pitch" else 5
    ax.semilogx(frequencies, each, f"{marker}-", label=path, markersize=size)
ax.set(title="Circles at 4 Hz tell most about the mass of the tail")
ax.set(xlabel="frequency of the torque (Hz)", ylabel="standard deviation of the mass (%)")
ax.set_xticks(frequencies, frequencies)
ax.minorticks_off()
ax.legend(title="path")
plt.show()

# %%
# The best of the twelve candidates, to be tried on other bodies:

flights["circle", 2].view(None, live=True)

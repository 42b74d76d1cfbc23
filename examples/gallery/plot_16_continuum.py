"""
How many links make a continuum?
================================

A tail can be modelled as rigid links, or as a continuum: arcs of constant curvature.
With more links the articulated tail should move like the continuum. We start both
with the same bend and spin, and compare where the tip of the tail goes.
"""

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

BEND, SPIN = 1.5, [15, 5, 0]  # rad, rad/s


def flight(model, links=1):
    """Return a flight that begins with the same bend, shared by all links."""
    q = [0, 0, 0.3, 1, 0, 0, 0, BEND / links, 0.5 / links]
    settings = {"t_span": 0.3, "output_step": 1e-3, "rtol": 1e-9}
    return st.simulate(model, q, [0, 0, 1.5, *SPIN, 0, 0], **settings)


smooth = flight(st.build(tail="continuum", segments=1))
counts = [2, 4, 8, 16]
tail = {"tail": "articulated", "segments": 1}
linked = [flight(st.build(**tail, links=n), n) for n in counts]


def tip(motion):
    """Return where the tip of the tail is at each time (m)."""
    return np.array([motion.model.tail_points(q)[-1] for q in motion.q])


# %%
# The first joint bends at the very root of the tail, where an arc has not bent yet. This
# difference, and that of the motions, about halves when the number of links doubles.

plt.style.use("seaborn-v0_8-colorblind")
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.4), layout="constrained")
off = [1e3 * np.linalg.norm(tip(motion) - tip(smooth), axis=1) for motion in linked]
for count, line in [(2, ":"), (4, "-."), (16, "-")]:
    left.plot(smooth.t, off[counts.index(count)], line, label=f"{count} links")
left.set(xlabel="time (s)", ylabel="distance of the tips (mm)", title="Tips drift apart ...")
left.legend()
worst = [each.max() for each in off]
right.loglog(counts, worst, "o-", label="largest distance")
right.loglog(counts, worst[-1] * (np.array(counts) / 16.0) ** -1, "--", label="1 / links")
right.set_xticks(counts, counts)
right.set_yticks([20, 50, 100], [20, 50, 100])
right.minorticks_off()
right.set(xlabel="links", title="... less with more links")
right.legend()
plt.show()

# %%
# The continuum and four links, over each other:

st.view([smooth, linked[1]], None, names=["continuum", "4 links"], live=True)

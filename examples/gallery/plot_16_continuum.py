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
    q = [0, 0, 0.3, 1, 0, 0, 0, BEND / links, 0.5 / links]
    settings = {"t_span": 0.3, "output_step": 1e-3, "rtol": 1e-9}
    return st.simulate(model, q, [0, 0, 1.5, *SPIN, 0, 0], **settings)


smooth = flight(st.build(tail="continuum", segments=1))
counts = [2, 3, 4, 6, 8, 12, 16]
linked = [flight(st.build(tail="articulated", segments=1, links=n), n) for n in counts]


def tip(motion):
    return np.array([motion.model.tail_points(q)[-1] for q in motion.q])


off = [np.linalg.norm(tip(motion) - tip(smooth), axis=1) for motion in linked]
print([1e3*o.max() for o in off])

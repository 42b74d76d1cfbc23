"""
A flight
========

A rat tumbles in the air, and its tail only damps.
"""

import numpy as np

import serpentail as st

model = st.build("kangaroo_rat_m1_n3")
q, v = np.zeros(model.nq), np.zeros(model.nv)
q[2], q[3], v[2], v[3] = 0.3, 1.0, 2.0, 20.0
flight = st.simulate(model, q, v, controller=st.Damping(1e-3), t_span=0.4)

# %%
# The motion is a page that moves.

flight

# %%
# Some of its numbers are drawn over time.

figure, axes = flight.plot("height", "tail")

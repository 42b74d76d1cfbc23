"""
What does the air do to righting?
=================================

A rat tumbles through the air, and ``st.plan`` rights it by the tail. Its tail is bare,
or ends in a tuft of hair, as a kangaroo rat's does. The tuft is 2 cm wide, which is
assumed, and weighs nothing. What does a plan gain that knows the air, and what happens
to one that ignores it?

This example needs CasADi: ``pip install "serpentail[plan]"``.
"""

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

bare = st.build("righting_m1_n3", air_density="1.2 kg/m3")
bodies = {
    "no air": st.build("righting_m1_n3"),
    "bare tail": bare,
    "tuft": bare.with_parameters(tail_widths=[0.0058, 0.0058, 0.02, 0.02]),
}
tumble = bare.state(height="34 cm", pitch="218 deg", velocity=[0, -0.3, 2.4], spin=[24, 3, -3])
task = {
    "start": tumble,
    "goal": st.Goal(torso_rate=None),  # upright, at any rate
    "bounds": st.Bounds(angle=np.pi / 3, torque="20 mN m"),
    "duration": (0.15, 0.58),
    "solver": st.Solver(track=False),
}
plans = {name: st.plan(body, **task) for name, body in bodies.items()}
for name, plan in plans.items():
    print(f"{name}: {1e3 * plan.report['energy_J']:.1f} mJ, {1e3 * plan.duration:.0f} ms")

# %%
# The torques of the plan without air, flown in air. Full lines are the plans that know
# the air of each body.

plain = plans["no air"]
torques = st.TorqueTable(plain.trajectory.t, plain.trajectory.tau)
flights = {
    name: st.simulate(body, *tumble, controller=torques, t_span=plain.duration)
    for name, body in bodies.items()
}


def tilt(motion):
    """Angle (deg) between the torso's and the world's vertical."""
    return np.degrees(np.arccos(st.rotation_matrix(motion.attitude)[:, 2, 2].clip(-1, 1)))


figure, ax = plt.subplots(figsize=(7, 3.4), layout="constrained")
for (name, flight), color in zip(flights.items(), ("C0", "C1", "C2"), strict=True):
    known = plans[name].trajectory
    ax.plot(1e3 * known.t, tilt(known), color, label=f"{name}, as planned")
    if name != "no air":
        ax.plot(1e3 * flight.t, tilt(flight), color, ls="--", label=f"{name}, plan ignores it")
ax.set(xlabel="time (ms)", ylabel="tilt of the torso (deg)")
ax.set_title("Planned without the air, flown in air: upside down")
ax.legend(fontsize="small")
plt.show()

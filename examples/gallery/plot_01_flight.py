"""
What a tumbling animal keeps in flight
======================================

A kangaroo rat tumbles in the air. Only gravity acts from outside, and gravity
has no moment about the centre of mass. Therefore the angular momentum stays
constant, whatever the tail does. The total energy stays constant, too, if no
torque acts at the joints of the tail.

We simulate the same start twice: with a free tail, and with a damper at each
joint.
"""

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

model = st.build(tail="articulated", segments=3, links=4)
q0 = [0, 0, 0.3, 1, 0, 0, 0] + [0.2, 0.1] * 3  # position, quaternion, joint angles
v0 = [0, 0.3, 2, 15, -8, 3] + [0, 0] * 3  # velocity, angular velocity, joint rates
settings = {"t_span": 0.4, "output_step": 1e-3, "rtol": 1e-9}
free = st.simulate(model, q0, v0, **settings)
damped = st.simulate(model, q0, v0, controller=st.Damping(1e-3), **settings)

# %%
# The angular velocity of the torso changes all the time: the tail takes angular
# momentum from the torso and gives it back. The sum stays constant in both flights.

plt.style.use("seaborn-v0_8-colorblind")
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.4), layout="constrained")
flights = {"free tail": (free, "-"), "damped tail": (damped, "--")}
for k, (name, (flight, line)) in enumerate(flights.items()):
    energy = 1e3 * (flight.energy - flight.energy[0])
    left.plot(flight.t, energy, line, color=f"C{k}", label=name)
    for axis, part in enumerate(1e3 * flight.angular_momentum.T):
        right.plot(flight.t, part, line, color=f"C{k}")
        if k == 0:
            right.annotate("xyz"[axis], (0.38, part[-1]), (0, 3), textcoords="offset points")
left.set(title="Damping takes energy ...", xlabel="time (s)", ylabel="change of energy (mJ)")
right.set(title="... but no angular momentum", xlabel="time (s)")
right.set_ylabel("angular momentum ($10^{-3}$ kg m$^2$/s)")
right.margins(y=0.15)
left.legend(loc="lower left")
plt.show()

# %%
# How exact is the integration? These numbers are zero in exact arithmetic.

momentum = np.abs(damped.angular_momentum - damped.angular_momentum[0]).max()
print(f"energy of the free tail: {np.abs(free.energy - free.energy[0]).max():.0e} J")
print(f"angular momentum of the damped tail: {momentum:.0e} kg m^2/s")

# %%
# Both flights over each other. Click *Play*, or drag the slider. Under *Change and compute
# again* you may change the first one: the page contains the model's C, and computes it.

st.view([free, damped], None, names=["free tail", "damped tail"], live=True)

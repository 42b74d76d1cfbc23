"""
Gradient descent on a whole flight with JAX
===========================================

``st.jax_functions`` gives functions that JAX can differentiate. A flight in a
``scan`` is then a function of all its torques, and its gradient tells which torque
changes the result most. Here plain gradient descent finds torques that right a tilted
animal. This example needs ``pip install "serpentail[jax]"`` and a C++ compiler.
"""

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

jax.config.update("jax_enable_x64", True)
model = st.build("righting_m1_n3")
rat = st.jax_functions(model)
STEP, COUNT = 2e-3, 150  # s, steps
q0 = np.r_[0, 0, 1, np.cos(0.4), np.sin(0.4), np.zeros(4)]  # pitched up by 0.8 rad
v0 = np.r_[0, 0, 1.5, np.zeros(5)]


def step(x, u):
    """One step of the classical Runge-Kutta method."""
    k1 = rat.x_dot(x, u)
    k2 = rat.x_dot(x + STEP / 2 * k1, u)
    k3 = rat.x_dot(x + STEP / 2 * k2, u)
    k4 = rat.x_dot(x + STEP * k3, u)
    x = x + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return x, x[7:9]


def loss(torques):
    """Tilt at the end, and bends of the tail, under torques (COUNT, 2) in mN m."""
    x, bends = jax.lax.scan(step, jnp.r_[q0, v0], 1e-3 * torques)
    return 2 * jnp.sum(x[4:6] ** 2) + 0.1 * jnp.mean(bends**2)  # 1 - z of the back, bends


# %%
# A function of 300 torques, its value and its exact gradient, compiled once:

slope = jax.jit(jax.value_and_grad(loss))
torques, losses = np.zeros((COUNT, 2)), []
_, first = slope(torques)
for _ in range(100):
    value, gradient = slope(torques)
    losses.append(float(value))
    torques = torques - 100 * gradient
table = st.TorqueTable(STEP * (np.arange(COUNT) + 0.5), 1e-3 * np.asarray(torques))
flight = st.simulate(model, q0, v0, controller=table, t_span=STEP * COUNT, output_step=1e-3)
tilt = np.degrees(np.arccos(np.clip(st.rotation_matrix(flight.q[:, 3:7])[:, 2, 2], -1, 1)))
print(f"loss {losses[0]:.3f}, then {losses[-1]:.3f}; tilt {tilt[0]:.1f}, then {tilt[-1]:.1f} deg")
print("largest angle of a joint:", np.degrees(abs(flight.tail)).max().round(), "deg")

# %%
# At first, torque early in the flight counts most, since it acts on the attitude for the
# longest time. The page shows the flight under the torques that were found.

plt.style.use("seaborn-v0_8-colorblind")
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
left.plot(table.times, first[:, 0])
left.set(title="The first gradient", xlabel="time of the torque (s)")
left.set_ylabel("slope of the loss (1 / (mN m))")
right.plot(flight.t, tilt)
right.set(title="After 100 steps", xlabel="time (s)", ylabel="tilt of the back (deg)")
plt.show()

flight.view(None, live=True)

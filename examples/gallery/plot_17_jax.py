"""
Gradients with JAX: when does the tail matter most?
===================================================

``st.jax_functions`` gives functions that JAX can differentiate. A flight in a
``scan`` is then a function of all its torques, and its gradient tells which torque
changes the result most. This example needs ``pip install "serpentail[jax]"``.
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
q0, v0 = np.r_[0, 0, 1, np.cos(0.5), np.sin(0.5), np.zeros(4)], np.r_[0, 0, 1.5, 3, np.zeros(4)]


def step(x, u):  # classical Runge-Kutta
    k1 = rat.x_dot(x, u)
    k2 = rat.x_dot(x + STEP / 2 * k1, u)
    k3 = rat.x_dot(x + STEP / 2 * k2, u)
    k4 = rat.x_dot(x + STEP * k3, u)
    return x + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4), None


def loss(torques):  # (COUNT, 2) mN m
    x, _ = jax.lax.scan(step, jnp.r_[q0, v0], 1e-3 * torques)
    return 2 * jnp.sum(x[4:6] ** 2) + 1e-3 * jnp.mean(torques**2)  # 1 - z of the back


slope = jax.jit(jax.value_and_grad(loss))
torques = np.zeros((COUNT, 2))
value, first = slope(torques)
losses = []
for k in range(60):
    value, gradient = slope(torques)
    losses.append(float(value))
    torques = torques - 20 * gradient
print(losses[::10], losses[-1], abs(torques).max())

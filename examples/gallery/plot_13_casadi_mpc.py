"""
Your own MPC with CasADi
========================

``model.casadi`` gives CasADi functions of a model, so any nonlinear program can
contain it. Here we write a model predictive controller: every 20 ms it plans the
next 0.24 s by multiple shooting, and applies the first torque. Its model of the tail
is a fifth too light. acados can take the same ``x_dot`` (see the page *Recipes*). This
example needs ``pip install "serpentail[plan]"``.
"""

import casadi
import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

rat = st.build("kangaroo_rat_m1_n3", purpose=["simulate", "derivatives"])
light = rat.with_parameters(tail_mass=0.8 * rat.parameters["tail_mass"])
x_dot = light.casadi.external("x_dot", derivatives=2, folded=True)  # compiled C, exact Hessian

STEP, HORIZON, TORQUE = 0.02, 12, 0.02  # s, steps, N m
x, u = casadi.MX.sym("x", rat.nq + rat.nv), casadi.MX.sym("u", 2)
k1 = x_dot(x, u)
k2 = x_dot(x + STEP / 2 * k1, u)
k3 = x_dot(x + STEP / 2 * k2, u)
k4 = x_dot(x + STEP * k3, u)
step = casadi.Function("step", [x, u], [x + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])

# %%
# The cost is small if, at every step, the back is upright, the torso turns slowly and
# the torques are small.

X, U = casadi.MX.sym("X", x.numel(), HORIZON), casadi.MX.sym("U", 2, HORIZON)
cost = casadi.sumsqr(X[4:6, :])  # sin^2 of half the tilt
cost += 2e-4 * casadi.sumsqr(X[12:15, :]) + 10 * casadi.sumsqr(U)
gaps = casadi.vec(X - step.map(HORIZON)(casadi.horzcat(x, X[:, :-1]), U))
quiet = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False, "ipopt.max_iter": 60}
solver = casadi.nlpsol(
    "mpc", "ipopt", {"x": casadi.veccat(X, U), "p": x, "f": cost, "g": gaps}, quiet
)
bound = np.r_[np.full(X.numel(), np.inf), np.full(U.numel(), TORQUE)]

q, v = np.r_[0, 0, 1, np.cos(0.6), np.sin(0.6), np.zeros(4)], np.r_[0, 0, 1, 0, 0.5, 0, 0, 0]
(q0, v0), held = (q, v), []
states, torques = np.tile(np.r_[q, v], (HORIZON, 1)), np.zeros((HORIZON, 2))
for k in range(20):
    guess = [np.vstack([part[1:], part[-1:]]).ravel() for part in (states, torques)]
    now = {"x0": np.concatenate(guess), "p": np.r_[q, v]}
    found = solver(**now, lbx=-bound, ubx=bound, lbg=0, ubg=0)["x"].full().ravel()
    states, torques = (part.reshape(HORIZON, -1) for part in np.split(found, [X.numel()]))
    held.append((k * STEP, st.TorqueTable([0, STEP], [torques[0], torques[0]])))
    moved = st.simulate(rat, q, v, controller=held[-1][1], t_span=STEP)
    q, v = moved.q[-1], moved.v[-1]
flight = st.simulate(rat, q0, v0, controller=st.Phases(held), t_span=0.4, output_step=1e-3)
tilt = np.degrees(np.arccos(np.clip(st.rotation_matrix(flight.q[:, 3:7])[:, 2, 2], -1, 1)))
print(f"tilt of the back: {tilt[0]:.1f} deg at the start, {tilt[-1]:.2f} deg at the end")

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
flight.plot("tilt", ax=left)
left.set_title("The back comes up")
flight.plot("torque", ax=right)
right.set_title("A new torque every 20 ms")
plt.show()

flight.view(None, live=True)

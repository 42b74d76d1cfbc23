"""Model-predictive control in the air: the tail rights a falling rat, planned anew every 20 ms.

The controller's tail is a fifth lighter than the one that flies; the tilt of the back is printed.
"""

from __future__ import annotations  # those of serpentail would import it

import argparse
import sys

import serpentail as st

STEP, HORIZON, FLIGHT = 0.02, 12, 20  # s, steps that are planned, steps that are flown
TORQUE = 0.02  # N m, the largest


def controller(model: st.Model):
    """Return a function from a state to torques (2m,) N m, which remembers its last plan."""
    import casadi
    import numpy as np

    f, nx, nu = model.casadi.external("x_dot", derivatives=2, folded=True), 9 + 8, 2
    x, u = casadi.MX.sym("x", nx), casadi.MX.sym("u", nu)
    k1 = f(x, u)
    k2 = f(x + STEP / 2 * k1, u)
    k3 = f(x + STEP / 2 * k2, u)
    k4 = f(x + STEP * k3, u)
    step = casadi.Function("step", [x, u], [x + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])

    # multiple shooting: the tilt of the back, its rate and the effort are small at every step
    X, U = casadi.MX.sym("X", nx, HORIZON), casadi.MX.sym("U", nu, HORIZON)
    before = casadi.horzcat(x, X[:, :-1])
    gaps = X - step.map(HORIZON)(before, U)
    tilt = casadi.sum2(X[4, :] ** 2 + X[5, :] ** 2)  # sin^2 of half the angle of the back
    cost = tilt + 2e-4 * casadi.sumsqr(X[12:15, :]) + 10 * casadi.sumsqr(U)
    nlp = {"x": casadi.veccat(X, U), "p": x, "f": cost, "g": casadi.vec(gaps)}
    quiet = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False, "ipopt.max_iter": 60}
    solver = casadi.nlpsol("mpc", "ipopt", nlp, quiet)
    bound = np.r_[np.full(nx * HORIZON, np.inf), np.full(nu * HORIZON, TORQUE)]
    memory = {}

    def torques(state):
        # the last plan a step later: from it as it was, the solver finds another at each step
        rows = memory.get("plan", (np.tile(state, (HORIZON, 1)), np.zeros((HORIZON, nu))))
        later = [np.vstack([part[1:], part[-1:]]).ravel() for part in rows]
        found = solver(x0=np.concatenate(later), p=state, lbx=-bound, ubx=bound, lbg=0, ubg=0)
        states, plan = np.split(found["x"].full().ravel(), [nx * HORIZON])
        memory["plan"] = states.reshape(HORIZON, nx), plan.reshape(HORIZON, nu)
        return plan[:nu]

    return torques


def main() -> None:
    """Fly, and print the tilt of the back."""
    import numpy as np

    names = "forward_dynamics_derivatives,forward_dynamics_vjp,inverse_dynamics_hessian,"
    names += "forward_dynamics,mass_matrix,energy,momentum,rollout"
    rat = st.build("kangaroo_rat_m1_n3", functions=names.split(","))
    torques = controller(rat.with_parameters(tail_mass=0.8 * rat.parameters["tail_mass"]))
    q = np.r_[0, 0, 1, np.cos(0.6), np.sin(0.6), 0, 0, 0, 0]
    v = np.r_[0, 0, 1, 0, 0.5, 0, 0, 0]
    for k in range(FLIGHT):
        held = st.TorqueTable([0, STEP], np.tile(torques(np.r_[q, v]), (2, 1)))
        flight = st.simulate(rat, q, v, controller=held, t_span=STEP)
        q, v = flight.q[-1], flight.v[-1]
        if k % 4 == 3:
            tilt = np.degrees(np.arccos(st.rotation_matrix(q[3:7])[2, 2]))
            print(f"{1e3 * STEP * (k + 1):4.0f} ms: the back is tilted by {tilt:5.1f} deg")


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__).parse_args()
    try:
        with st.progress():
            main()
    except KeyboardInterrupt:
        sys.exit("interrupted: nothing is kept")

"""A small optimal control problem for ``casadi.Function``s of the dynamics; needs only casadi and
numpy.

From a turning start the tail goes to given coordinates with the least sum of squared torques;
implicit midpoint, the attitude a quaternion. Run as a program, it compares a compiled model with
its CasADi module.
"""

import sys
from types import SimpleNamespace

import casadi
import numpy as np

STEP, TORQUE = 0.02, 1e-4  # s, N m: units in which torques are of the order of 1
QUIET = {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes", "ipopt.tol": 1e-10}


def rate(q, v):
    """Return the rate of q: the quaternion rotates with the angular velocity in body axes."""
    w, e, omega = q[3], q[4:7], v[3:6]
    turn = casadi.vertcat(-casadi.dot(e, omega), w * omega + casadi.cross(e, omega))
    return casadi.vertcat(v[:3], 0.5 * turn, v[6:])


def problem(f, parameters, nodes):
    """Return the NLP that has the dynamics f as constraints, and where to start."""
    forward = "tau" in f.name_in()
    nq, nv = f.size1_in(0), f.size1_in(1)
    nt = nv - 6
    q, v = casadi.MX.sym("q", nq, nodes + 1), casadi.MX.sym("v", nv, nodes + 1)
    tau = casadi.MX.sym("tau", nt, nodes)
    defects = []
    for k in range(nodes):
        at = (q[:, k] + q[:, k + 1]) / 2, (v[:, k] + v[:, k + 1]) / 2
        slope = (v[:, k + 1] - v[:, k]) / STEP
        torque = TORQUE * tau[:, k]
        defects.append((q[:, k + 1] - q[:, k]) / STEP - rate(*at))
        if forward:
            # light segments accelerate more
            defects.append(2e-3 / nt**2 * (slope - f(*at, torque, parameters)))
        else:
            defects.append(f(*at, slope, parameters) - casadi.vertcat(casadi.MX.zeros(6), torque))
    start_q, start_v = np.zeros(nq), np.zeros(nv)
    start_q[3], start_v[3], start_v[6] = 1, 0.3, 0.2
    ends = [q[:, 0] - start_q, v[:, 0] - start_v, q[7:, nodes] - 0.15 * np.arange(1, nt + 1) / nt]
    states = (np.tile(x, nodes + 1) for x in (start_q, start_v))
    nlp = {"x": casadi.veccat(q, v, tau), "f": casadi.sumsqr(tau)}
    return nlp | {"g": casadi.veccat(*defects, *ends)}, np.concatenate(
        [*states, np.ones(nt * nodes)]
    )


def plan(f, parameters, nodes=8, **options):
    """Solve by IPOPT with exact second derivatives; return the solution, its value, and the
    solver's statistics.
    """
    nlp, guess = problem(f, parameters, nodes)
    options = QUIET | {f"ipopt.{key}": value for key, value in options.items()}
    solver = casadi.nlpsol("solver", "ipopt", nlp, options)
    found = solver(x0=guess, lbg=0, ubg=0)
    x, value = np.array(found["x"]).ravel(), float(found["f"])
    return SimpleNamespace(x=x, value=value, **solver.stats())


def derivatives(f):
    """Return the Jacobian, the adjoint and the adjoint's Jacobian of a function."""
    return {"jac": f.jacobian(), "adj1": f.reverse(1), "jac_adj1": f.reverse(1).jacobian()}


def difference(a, b):
    """Return the largest difference of two matrices, relative to the largest entry of the
    second.
    """
    a, b = (np.array(casadi.DM(x)) for x in (a, b))
    return np.max(np.abs(a - b), initial=0) / (np.max(np.abs(b), initial=0) + 1e-300)


def blocks(f, at):
    """Return the outputs of a derivative that do not concern the parameters, as sparse matrices by
    name.
    """
    seeds = {name: np.sin(1 + np.arange(f.numel_in(name))) for name in f.name_in()}
    found = f(**{name: at.get(name, seed) for name, seed in seeds.items()})
    return {name: casadi.DM(value) for name, value in found.items() if "parameters" not in name}


def main(module_folder, module_name, library, parameters):
    """Compare the compiled functions with those of the module; print what differs."""
    sys.path.insert(0, module_folder)
    module, bad = __import__(module_name), []
    parameters = casadi.DM([float(x) for x in parameters.split(",")])
    for name, last in (("forward_dynamics", "tau"), ("inverse_dynamics", "v_dot")):
        prefix = module_name.removesuffix("_casadi")
        f, g = casadi.external(f"{prefix}_casadi_{name}", library), module.function(name)
        at = {key: np.cos(1 + np.arange(f.numel_in(key))) for key in ("q", "v", last)}
        at |= {"parameters": parameters} | ({"tau": 1e-3 * at["tau"]} if last == "tau" else {})
        for kind, mine in derivatives(f).items():
            theirs = blocks(derivatives(g)[kind], at)
            bad += [
                (name, kind, key)
                for key, value in blocks(mine, at).items()
                if difference(value, theirs[key]) > 1e-11
            ]
        mine, theirs = plan(f, parameters), plan(g, parameters)
        bad += [(name, "plan")] if difference(mine.x, theirs.x) > 1e-8 or not mine.success else []
    print(f"casadi {casadi.__version__}: {bad or 'all agree'}")


if __name__ == "__main__":
    main(*sys.argv[1:])

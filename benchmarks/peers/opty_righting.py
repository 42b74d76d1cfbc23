"""Solves the righting problem with opty, to compare planning times.

It needs opty and cyipopt, which ``make setup`` does not install. cyipopt can be built against the
IPOPT that CasADi brings, with an ipopt.pc that names its folder. It finds that library at run time
once CasADi has solved a program.
"""

import sys
import time

import numpy as np
import sympy

import serpentail as st
from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.pipeline import tail_of
from serpentail_codegen.scene.scene import Scene

MOST = 3000  # iterations
UNIT = 1e-3  # N m, of torques in the objective
TIME = sympy.Symbol("t")


def solved(scene: Scene, guess: st.Trajectory, bounds: st.Bounds, smoothing: float) -> dict:
    """Plan by opty (midpoint rule, no Hessian) from the start of the guess to upright and at rest
    at its end.

    Returns setup_s and solve_s, CPU seconds of this process (without the C compiler), and the
    status.
    """
    sys.setrecursionlimit(100_000)  # of SymPy: its expressions are deep
    from opty import Problem

    nodes, duration = guess.q.shape[0], guess.t[-1]
    q, v, tau = (
        _functions(name, part.shape[1])
        for name, part in (("q", guess.q), ("v", guess.v), ("u", guess.tau))
    )
    step, states = duration / (nodes - 1), q + v
    at_start = [
        x.func(0) - float(value)
        for x, value in zip(states, (*guess.q[0], *guess.v[0]), strict=True)
    ]
    at_end = [x.func(duration) for x in (q[4], q[5], *v[3:6])]
    limits = dict.fromkeys(tau, (-bounds.torque, bounds.torque)) | dict.fromkeys(
        q[7:], (-bounds.angle, bounds.angle)
    )
    weights = np.concatenate(
        [np.zeros(len(states) - len(tau)), np.full(len(tau), smoothing), np.ones(len(tau))]
    )
    weights = step * np.repeat((weights / UNIT) ** 2, nodes)
    begun = time.process_time()
    problem = Problem(
        lambda free: float(weights @ free**2),
        lambda free: 2 * weights * free,
        equations(scene, q, v, tau),
        states,
        nodes,
        step,
        instance_constraints=at_start + at_end,
        bounds=limits,
        time_symbol=TIME,
        integration_method="midpoint",
    )
    setup = time.process_time() - begun
    for option, value in (("max_iter", MOST), ("print_level", 0), ("sb", "yes")):
        problem.add_option(option, value)
    begun = time.process_time()
    _, info = problem.solve(
        np.concatenate([guess.q.T.ravel(), guess.v.T.ravel(), guess.tau.T.ravel()])
    )
    spent = time.process_time() - begun
    return {"setup_s": setup, "solve_s": spent, "status": info["status_msg"].decode()}


def equations(scene: Scene, q: list, v: list, tau: list) -> sympy.Matrix:
    """q_dot and H v_dot + C - [0; tau], which must be zero, as SymPy expressions of functions of
    time.
    """
    inverse = assemble(CATALOGUE["inverse_dynamics"], tail_of(scene))
    sizes = {"q": len(q), "v": len(v), "v_dot": len(v)}
    plain = {name: sympy.symbols(f"{name}:{size}") for name, size in sizes.items()}
    numbers = Numbers(sympy, lambda x: sympy.Float(float(x)))
    known = {
        name: [numbers.convert(x) for x in np.ravel(value)]
        for name, value in scene.parameters.items()
    } | plain
    arrays = (*inverse.of_role("parameters"), *inverse.of_role("input"))
    (output,) = inverse.of_role("output")
    force = Run(inverse, numbers, {a.name: list(known[a.name]) for a in arrays}).values[output.name]
    moving = dict(
        zip(
            (*plain["q"], *plain["v"], *plain["v_dot"]),
            (*q, *v, *(x.diff(TIME) for x in v)),
            strict=True,
        )
    )
    balance = [f.xreplace(moving) - load for f, load in zip(force, [0] * 6 + tau, strict=True)]
    scaled = [x if k < 3 else 1e3 * x for k, x in enumerate(balance)]  # N m are small here
    (w, x, y, z), (a, b, c) = q[3:7], v[3:6]
    turn = [
        -x * a - y * b - z * c,
        w * a + y * c - z * b,
        w * b - x * c + z * a,
        w * c + x * b - y * a,
    ]
    rates = [*v[:3], *(entry / 2 for entry in turn), *v[6:]]
    return sympy.Matrix([x.diff(TIME) - rate for x, rate in zip(q, rates, strict=True)] + scaled)


def _functions(name: str, size: int) -> list:
    return [sympy.Function(f"{name}{k}")(TIME) for k in range(size)]

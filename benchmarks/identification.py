"""Times identification against opty's approach: the midpoint rule, and IPOPT without exact
Hessians.

opty takes SymPy's equations, which no tail has here. Its nonlinear program is therefore built in
CasADi: states at nodes, the midpoint rule between them, and IPOPT with its limited-memory Hessian.
Both get the same exact tracks, the same wrong parameters and the same first motion. The tracks have
no noise, so that only the error of the method remains. The rule is tried with an exact Hessian,
too.
"""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("identification", __doc__)

import time
from pathlib import Path

import numpy as np

import serpentail as st
from examples.studies import identification as study
from serpentail.identification.placement import placements
from serpentail.identification.start import interpolated, motion_shown

NAMES = ("tail_mass", "tail_length", "tail_stiffness[same]", "tail_damping[same]")
BEGIN = np.array([4.2e-3, 0.185, 3e-3, 3e-5])
TRUE = np.array([0.00351, 0.19466, 2e-3, 5e-5])
PARTS = 1  # intervals a frame of the midpoint rule
DURATION, FRAMES = 0.15, 31
MOST = 3000  # iterations of IPOPT


def identification_times(folder: Path) -> list[dict]:
    """Seconds of processor time, iterations, and the largest relative error of a parameter."""
    model, _ = study.scene(1, 3)
    times = np.linspace(0, DURATION, FRAMES)
    states = study.flown(model, times, np.zeros((2, 2)), times[[0, -1]])
    torso = {"nose": (0, 0.05, 0.01), "left": (-0.025, -0.02, 0.02)}
    torso |= {"right": (0.025, -0.02, 0.02), "back": (0, 0, 0.03)}
    markers = {name: st.Marker(torso=place) for name, place in torso.items()}
    markers |= {f"tail{k}": st.Marker(tail=k / 3) for k in (1, 2, 3)}
    seen = st.marker_positions(model, states[:, : model.nq], markers)
    tracks = st.marker_tracks(times, seen, list(markers), unit="m")
    wrong = model.with_parameters(
        tail_mass=BEGIN[0], tail_length=BEGIN[1], tail_stiffness=BEGIN[2], tail_damping=BEGIN[3]
    )
    begun = time.process_time()
    found = st.identify(wrong, tracks, markers, NAMES)
    ours = np.array([each.value for each in found.parameters])
    rows = [_row("ours", time.process_time() - begun, found.iterations, ours)]
    first = motion_shown(placements(wrong, markers), tracks)
    for exact in (False, True):
        rows.append(midpoint(model, (times, seen, first), list(torso.values()), exact))
    return rows


def _row(name: str, seconds: float, iterations: int, values: np.ndarray) -> dict:
    """Return a row of the table."""
    error = float(np.abs(values / TRUE - 1).max())
    return {"method": name, "cpu_s": seconds, "iterations": iterations, "error": error}


def midpoint(model: st.Model, data: tuple, torso: list, exact: bool) -> dict:
    """Return the row of the midpoint rule, with opty's or with an exact Hessian."""
    import casadi as ca

    (times, seen, first), parts = data, PARTS
    begun = time.process_time()
    mesh = np.interp(np.arange(parts * (len(times) - 1) + 1), parts * np.arange(len(times)), times)
    theta = ca.MX.sym("theta", 4)  # relative to their initial values
    p = _struct(model, theta * BEGIN)
    x_dot, points = model.casadi.x_dot, model.casadi.symbolic("tail_points")
    nx = model.nq + model.nv
    a, b, h = ca.MX.sym("a", nx), ca.MX.sym("b", nx), ca.MX.sym("h")
    rate = x_dot((a + b) / 2, np.zeros(model.nq - 7), p)
    defect = ca.Function("defect", [a, b, h, theta], [b - a - h * rate])
    q = a[: model.nq]
    w, u = q[3], q[4:7]
    turned = [q[:3] + at + 2 * ca.cross(u, ca.cross(u, at) + w * at) for at in map(ca.DM, torso)]
    tail = points(q, p).T
    modelled = ca.Function("modelled", [a, theta], [ca.horzcat(*turned, tail[:, 1:])])
    X = ca.MX.sym("X", nx, len(mesh))
    rules = [
        defect(X[:, k], X[:, k + 1], mesh[k + 1] - mesh[k], theta) for k in range(len(mesh) - 1)
    ]
    cost = 0
    for f, row in enumerate(seen):
        cost += ca.sumsqr(modelled(X[:, parts * f], theta) - row.T)
    program = {"x": ca.vertcat(theta, ca.vec(X)), "f": 1e6 * cost, "g": ca.vertcat(*rules)}
    options = {
        "ipopt.hessian_approximation": "exact" if exact else "limited-memory",
        "ipopt.max_iter": MOST,
        "ipopt.print_level": 0,
        "print_time": False,
    }
    solver = ca.nlpsol("solver", "ipopt", program, options)
    guess = interpolated(times, first, mesh)
    done = solver(x0=np.concatenate([np.ones(4), guess.ravel()]), lbg=0, ubg=0)
    values = done["x"].full().ravel()[:4] * BEGIN
    count = solver.stats()["iter_count"]
    name = f"midpoint, {'exact' if exact else 'limited-memory'} Hessian"
    return _row(name, time.process_time() - begun, count, values)


def _struct(model: st.Model, values):
    """Return the parameter struct with other values; the inertia of the links follows from them
    (Table 1).
    """
    import casadi as ca

    mass, length, stiffness, damping = ca.vertsplit(values)
    m, piece, r = mass / 3, length / 3, model.parameters["link_radius"]
    across, along = m / 5 * (piece**2 / 4 + r**2), m / 5 * 2 * r**2
    own = {
        "tail_mass": [mass],
        "tail_length": [length],
        "link_inertia": [across, along, across],
        "tail_stiffness": [stiffness] * 2,
        "tail_damping": [damping] * 2,
    }
    entries = []
    for each in model.manifest["parameters"]:
        if each["in_struct"]:
            kept = np.atleast_1d(model.parameters[each["name"]]).tolist()
            entries += own.get(each["name"], kept)
    return ca.vertcat(*entries)

"""Largest errors of H and v_dot of one segment at bend theta, in bend and in polar coordinates.

Over six random states, against 50 digits. Rates of all coordinates are some 10 rad/s. Accelerations
are compared in bend components. "refused": some H was not positive definite, so that v_dot does not
exist. The picture is OUTPUT/polar_errors.png.
"""

from functools import partial
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.models import built

THETAS = (*(10.0 ** (np.arange(-24, 2) / 3)), np.pi, 2 * np.pi)
STATES = 6  # at each theta; the worst error counts
REFUSED = "refused"
PAPER_SWITCH = 1e-6  # rad: below, the paper treats the segment as a rigid link
COLOURS = {"bend": "#0072b2", "polar": "#d55e00"}
LABELS = {"bend": "bend components", "polar": "polar closed forms"}


def form(coordinates: str, segments: int) -> st.Model:
    """Return the tail in one form."""
    name = f"continuum_m{segments}_{coordinates}"
    return built(segments, coordinates=coordinates, name=name)


def measured(folder: Path) -> list[dict]:
    """Return a row for each bend."""
    from tests.references.exact_polar import ExactPolar

    models = {name: form(name, 1) for name in COLOURS}
    exact = ExactPolar(models["polar"].parameters, 1)
    rows = []
    for theta in THETAS:
        errors = [state_errors(models, exact, *state(theta, seed)) for seed in range(STATES)]
        row: dict = {"theta": f"{theta:.3g}"}
        for key in errors[0]:
            found = [each[key] for each in errors]
            row[key] = REFUSED if None in found else max(found)
        rows.append(row)
    return rows


def state(theta: float, seed: int) -> tuple[np.ndarray, ...]:
    """Return q, v, tau in polar angles, bent by theta; the torque on phi vanishes with theta, as in
    reality.
    """
    rng = np.random.default_rng(seed)
    q, v, tau = rng.normal(size=9), 10 * rng.normal(size=8), 1e-3 * rng.normal(size=2)
    q[3:7] /= np.linalg.norm(q[3:7])
    q[7:] = rng.uniform(0, 2 * np.pi), theta
    return q, v, tau * (theta, 1)


def state_errors(models: dict, exact, q, v, tau) -> dict:
    """Return the errors of both forms at one state, each at its own float64 numbers."""
    from tests.references.metrics import mass_matrix_error

    in_bend = [np.array(x, float) for x in (*exact.state(q, v), exact.force(q, tau))]
    expected = exact.bend.mass_matrix(in_bend[0])
    row = {"H, bend": mass_matrix_error(models["bend"].mass_matrix(in_bend[0]), expected)}
    row["H, polar"] = mass_matrix_error(models["polar"].mass_matrix(q), exact.mass_matrix(q))
    row["v_dot, bend"] = v_dot_error(models["bend"], exact, in_bend, lambda v_dot: v_dot)
    to_bend = partial(exact.acceleration, q, v)
    row["v_dot, polar"] = v_dot_error(models["polar"], exact, (q, v, tau), to_bend)
    return row


def v_dot_error(model: st.Model, exact, arguments, to_bend) -> float | None:
    """Return the error of forward dynamics in bend components; None if the model refuses."""
    from tests.references.metrics import block_error

    q, v, tau = arguments
    try:
        found = np.array(to_bend(model.forward_dynamics(q, v, tau)), float)
    except st.StateError:
        return None
    if "polar" in model.name:
        (q, v), tau = exact.state(q, v), exact.force(q, tau)
    return block_error(found, exact.bend.forward_dynamics(q, v, tau))


def draw(rows: list[dict], path: Path) -> None:
    """Draw the errors of H and v_dot against theta."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    for axes, quantity in ((left, "H"), (right, "v_dot")):
        draw_errors(axes, rows, quantity)
        axes.set_title(f"error of {quantity}, m = 1")
    right.tick_params(labelleft=False)
    left.set_ylabel("largest relative error of six states")
    handles = right.get_legend_handles_labels()
    figure.legend(*handles, loc="outside lower center", ncols=4, frameon=False)
    figure.savefig(path, dpi=100)


def draw_errors(axes, errors: list[dict], quantity: str) -> None:
    """Draw one error of both forms; crosses mark missing results."""
    theta = np.array([float(row["theta"]) for row in errors])
    for name, colour in COLOURS.items():
        values = [row[f"{quantity}, {name}"] for row in errors]
        given = np.array([value != REFUSED for value in values])
        numbers = [value for value in values if value != REFUSED]
        axes.loglog(theta[given], numbers, "o-", color=colour, markersize=3.5, label=LABELS[name])
        if not given.all():
            crosses = theta[~given], np.full((~given).sum(), 10.0)
            axes.plot(*crosses, "x", color=colour, label="H not positive definite")
    axes.plot(theta, 2e-15 * theta**-4.0, ":", color="0.4", label=r"$2\cdot10^{-15}/\theta^4$")
    axes.axvline(PAPER_SWITCH, color="0.6", linewidth=1, linestyle="--")
    style = {"rotation": 90, "va": "center", "fontsize": 8, "color": "0.35"}
    axes.text(PAPER_SWITCH * 1.25, 3e-9, "the paper's switch to a rigid link", **style)
    axes.set(xlim=(6e-9, 12), ylim=(1e-17, 100), xlabel="bend theta of the segment, rad")
    axes.set_xticks(10.0 ** np.arange(-8, 1, 2))
    axes.set_yticks(10.0 ** np.arange(-16, 1, 4))
    axes.grid(color="0.9")

"""The continuum tail in two forms, bend components and the paper's polar closed forms: errors, run
times, a picture.
"""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("continuum_forms", __doc__)

from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.fixtures import built, fixture
from benchmarks.peers import timing

THETAS = (*(10.0 ** (np.arange(-24, 2) / 3)), np.pi, 2 * np.pi)
STATES = 6  # at each theta; the worst error counts
ROUNDS, CALLS = 200, 256
REFUSED = "refused"
PAPER_SWITCH = 1e-6  # rad: below, the paper treats the segment as a rigid link
COLOURS = {"bend": "#0072b2", "polar": "#d55e00"}
LABELS = {"bend": "bend components", "polar": "polar closed forms"}


def form(coordinates: str, segments: int) -> st.Model:
    """Return the tail in one form."""
    name = f"continuum_m{segments}_{coordinates}"
    return built(segments, coordinates=coordinates, name=name)


def form_errors(folder: Path) -> list[dict]:
    """Largest errors of H and v_dot of one segment at bend theta over six random states, against 50
    digits. Rates of all coordinates are some 10 rad/s. Accelerations are compared in bend
    components. "refused": some H was not positive definite, so that v_dot does not exist.
    """
    from tests.references.exact_polar import ExactPolar

    models = {name: form(name, 1) for name in COLOURS}
    exact = ExactPolar(models["polar"].parameters, 1)
    rows = []
    for theta in THETAS:
        errors = [state_errors(models, exact, *state(theta, seed)) for seed in range(STATES)]
        row = {"theta": f"{theta:.3g}"} | {
            key: REFUSED if None in x else max(x) for key, x in columns(errors).items()
        }
        rows.append(row)
    return rows


def columns(rows: list[dict]) -> dict[str, list]:
    """Return the values of each key."""
    return {key: [row[key] for row in rows] for key in rows[0]}


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
    row = {"bend_H": mass_matrix_error(models["bend"].mass_matrix(in_bend[0]), expected)}
    row["polar_H"] = mass_matrix_error(models["polar"].mass_matrix(q), exact.mass_matrix(q))
    row["bend_v_dot"] = v_dot_error(models["bend"], exact, in_bend, lambda v_dot: v_dot)
    row["polar_v_dot"] = v_dot_error(
        models["polar"], exact, (q, v, tau), lambda x: exact.acceleration(q, v, x)
    )
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


def form_times(folder: Path) -> list[dict]:
    """Nanoseconds of one forward dynamics call from C of both forms, rounds interleaved, and
    operations of each.
    """
    rows = []
    for m in (1, 3):
        pair = {name: fixture(form(name, m), folder) for name in COLOURS}
        q, v, tau = timing.random_states(m)
        q[:, 8::2] = (
            np.abs(q[:, 8::2]) + 0.5
        )  # polar: theta; bend: b, which does not affect its run time
        times = timing.time_rounds(
            [entry.closure for entry in pair.values()], (q, v, tau), ROUNDS, CALLS
        )
        row = {"segments": m} | {
            f"{name}_ns": least for name, (least, _) in zip(pair, times, strict=True)
        }
        row["form_ratio"] = f"{times[1][0] / times[0][0]:.2f} ({times[1][1] / times[0][1]:.2f})"
        for name, entry in pair.items():
            row[f"{name}_operations"] = entry.model.manifest["functions"]["forward_dynamics"][
                "operations"
            ]
        rows.append(row)
    return rows


def draw(errors: list[dict], times: list[dict], path: Path) -> None:
    """Draw the errors of H and v_dot against theta, and the run times beside them."""
    import matplotlib as mpl

    mpl.use("agg")
    import matplotlib.pyplot as plt

    widths = {"width_ratios": (3, 3, 1.6)}
    figure, (left, right, side) = plt.subplots(
        1, 3, figsize=(10, 4.2), layout="constrained", gridspec_kw=widths
    )
    for axes, quantity, title in ((left, "H", "H"), (right, "v_dot", "v_dot")):
        draw_errors(axes, errors, quantity)
        axes.set_title(f"error of {title}, m = 1")
    right.tick_params(labelleft=False)
    left.set_ylabel("largest relative error of six states")
    figure.legend(
        *right.get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False
    )
    draw_times(side, times)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def draw_errors(axes, errors: list[dict], quantity: str) -> None:
    """Draw one error of both forms; crosses mark missing results."""
    theta = np.array([float(row["theta"]) for row in errors])
    for name, colour in COLOURS.items():
        values = [row[f"{name}_{quantity}"] for row in errors]
        given = np.array([value != REFUSED for value in values])
        numbers = [value for value in values if value != REFUSED]
        axes.loglog(theta[given], numbers, "o-", color=colour, markersize=3.5, label=LABELS[name])
        if not given.all():
            axes.plot(
                theta[~given],
                np.full((~given).sum(), 10.0),
                "x",
                color=colour,
                label="H not positive definite",
            )
    axes.plot(theta, 2e-15 * theta**-4.0, ":", color="0.4", label=r"$2\cdot10^{-15}/\theta^4$")
    axes.axvline(PAPER_SWITCH, color="0.6", linewidth=1, linestyle="--")
    axes.text(
        PAPER_SWITCH * 1.25,
        3e-9,
        "the paper's switch to a rigid link",
        rotation=90,
        va="center",
        fontsize=8,
        color="0.35",
    )
    axes.set(xlim=(6e-9, 12), ylim=(1e-17, 100), xlabel="bend theta of the segment, rad")
    axes.set_xticks(10.0 ** np.arange(-8, 1, 2))
    axes.set_yticks(10.0 ** np.arange(-16, 1, 4))
    axes.grid(color="0.9")


def draw_times(axes, times: list[dict]) -> None:
    """Draw nanoseconds a call as bars, one pair for each number of segments."""
    for k, (name, colour) in enumerate(COLOURS.items()):
        places = np.arange(len(times)) + (k - 0.5) * 0.36
        bars = axes.bar(places, [row[f"{name}_ns"] for row in times], 0.34, color=colour)
        axes.bar_label(bars, fmt="%.0f", fontsize=8)
    axes.set_xticks(range(len(times)), [f"m = {row['segments']}" for row in times])
    axes.set(title="run time of v_dot", ylabel="ns a call from C")

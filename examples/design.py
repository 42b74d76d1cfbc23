"""Design of an experiment: which wave of the tail makes its parameters most certain.

Every candidate drives the tail with the same largest torque, at another frequency and along another
path, and is judged before anything is recorded: by the Fisher information of the markers that the
cameras would see. D-optimality, the logarithm of its determinant, ranks them. Writes design.csv.
"""

import argparse
from itertools import product

from examples import front

OUTPUT = "output/identification"
TORQUE, DURATION, RATE, NOISE = 1e-3, 0.3, 200.0, 5e-4  # N m, s, Hz, m
FREQUENCIES = (2.0, 4.0, 8.0, 16.0)  # Hz
PATHS = {"pitch": (1.0, 0.0, 0.0), "yaw": (0.0, 1.0, 0.0), "circle": (1.0, 1.0, 0.25)}
FUNCTIONS = (
    *("mass_matrix", "bias_force", "inverse_dynamics", "forward_dynamics", "tail_points"),
    *("energy", "momentum", "forward_dynamics_derivatives"),
    "forward_dynamics_parameter_derivatives",
)
WANTED = ("torso_mass", "torso_inertia", "tail_mass", "tail_stiffness[same]", "tail_damping[same]")


def main(arguments: argparse.Namespace) -> None:
    """Fly every candidate, print and write what it would tell, the best first."""
    import csv
    import tomllib

    import numpy as np

    import serpentail as st
    from serpentail.scenes.identify import identify_arguments

    scene = front.ROOT / "scenes" / "identify_tail.toml"
    rat = st.build(scene, functions=[*FUNCTIONS, "rollout"])
    table = tomllib.loads(scene.read_text(encoding="utf-8"))["identify"]
    markers = identify_arguments(table)["markers"]
    rows = []
    for frequency, (path, (first, second, lag)) in product(FREQUENCIES, PATHS.items()):

        def wave(t, _q, _v, f=frequency, a=first, b=second, lag=lag):
            angle = 2 * np.pi * f * t
            return TORQUE * np.array([a * np.sin(angle), b * np.sin(angle + 2 * np.pi * lag)])

        q, v = [0, 0, 0.3, 1, 0, 0, 0, 0, 0], [0, 0, 1.5, 0, 0, 0, 0, 0]
        flight = st.simulate(rat, q, v, controller=wave, t_span=DURATION, output_step=5e-4)
        told = st.fisher_information(rat, flight, markers, WANTED, noise=NOISE, rate=RATE)
        of = zip(told.std.items(), told.values, strict=True)
        part = {name: 100 * std / value for (name, std), value in of}
        rows.append({"path": path, "Hz": frequency, "D": told.d_optimality} | part)
    rows.sort(key=lambda row: -row["D"])
    arguments.folder.mkdir(parents=True, exist_ok=True)
    file = arguments.folder / "design.csv"
    with file.open("w", newline="", encoding="utf-8") as target:
        writer = csv.DictWriter(target, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    print("path    Hz      D   torso mass, tail mass, stiffness, damping: std in %")
    for row in rows:
        stds = "  ".join(f"{row[n]:8.2g}" for n in (WANTED[0], *WANTED[2:]))
        print(f"{row['path']:<7} {row['Hz']:>2.0f} {row['D']:6.1f}   {stds}")
    print(file)


if __name__ == "__main__":
    front.run(main, front.parser(__doc__, OUTPUT).parse_args())

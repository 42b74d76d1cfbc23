"""Generates marker tracks of a known flight: the recording of docs/identification.md.

A rat with a limp elastic tail tumbles; eight markers are seen at 200 Hz for 0.3 s, with 0.5 mm of
noise and a tenth of them in gaps. Its tail: 3.51 g, 194.66 mm, 2 mN m/rad, 0.05 mN m s. Nobody
recorded it: it is made so that the truth is known. Writes tail_markers.trc.
"""

import argparse
import tomllib

from examples import front

OUTPUT = "output/identification"
TRUE = {"tail_mass": 0.00351, "tail_length": 0.19466, "tail_stiffness": 2e-3, "tail_damping": 5e-5}
DURATION, RATE, NOISE, GAPS = 0.3, 200, 5e-4, 0.1  # s, Hz, m, part of all positions


def main(arguments: argparse.Namespace) -> None:
    """Fly, place the markers, write what the cameras see."""
    import numpy as np

    import serpentail as st
    from serpentail.scenes.identify import identify_arguments

    scene = front.ROOT / "scenes" / "identify_tail.toml"
    rat = st.build(scene).with_parameters(**TRUE)
    times = np.arange(round(DURATION * RATE) + 1) / RATE
    q = [0, 0, 0.3, 1, 0, 0, 0, 0.4, -0.3]
    v = [0, 0.3, 1.5, 4, 2, -3, 5, 8]
    flight = st.simulate(rat, q, v, t_span=DURATION, output_step=1 / RATE)
    # where the scene's table [identify] has the markers
    table = tomllib.loads(scene.read_text(encoding="utf-8"))["identify"]
    markers = identify_arguments(table)["markers"]
    rng = np.random.default_rng(20)
    seen = st.marker_positions(rat, flight.q, markers)
    seen += NOISE * rng.standard_normal(seen.shape)
    seen[rng.random(seen.shape[:2]) < GAPS] = np.nan
    arguments.folder.mkdir(parents=True, exist_ok=True)
    tracks = st.marker_tracks(times, seen, list(markers), unit="m")
    print(st.write_markers(tracks, arguments.folder / "tail_markers.trc"))


if __name__ == "__main__":
    front.run(main, front.parser(__doc__, OUTPUT).parse_args())

"""Tapered tails of few arcs: how wrong their inertia is, by sums over thin slices of the rod."""

from itertools import pairwise

import numpy as np
import pytest

import serpentail as st
from serpentail.model.even_arcs import excess, warn_of_even_arcs
from serpentail_codegen.scene.parse import parse_scene, scene_to_dict
from tests.support.rows import row

CONE = {"length": "200 mm", "radii": "4, 1 mm", "density": "1 g/cm^3"}
ARC, LINKS = {"kind": "continuum"}, {"kind": "articulated", "links": 3}


def thin(ends, count=200_000):
    """Places (m) and masses (kg) of thin slices of the cone between two places."""
    edges = np.linspace(*ends, count + 1)
    places = (edges[1:] + edges[:-1]) / 2
    return places, 1000 * np.pi * np.interp(places, [0, 0.2], [0.004, 0.001]) ** 2 * np.diff(edges)


def test_the_excess_is_that_of_evenly_spread_slices():
    for kind, segments, arcs in (
        *(("continuum", count, np.linspace(0, 0.2, count + 1)) for count in (1, 2, 3, 8)),
        *(("mixed", [LINKS, ARC], [0.1, 0.2]), ("mixed", [ARC, LINKS], [0, 0.1])),
    ):
        scene = parse_scene({"kind": kind, "segments": segments, "taper": CONE}, "x")
        places, masses = thin((0, 0.2))
        true, even = masses @ places**2, masses @ places**2
        for ends in pairwise(arcs):
            places, masses = thin(ends)
            even += masses.mean() * (places**2).sum() - masses @ places**2
        with row(kind, segments):
            found = excess({"scene": scene_to_dict(scene)}, scene.parameters)
            # links are wider than a rod without thickness
            assert found == pytest.approx(
                even / true - 1, rel=1e-6 if kind == "continuum" else 2e-3
            )


def test_a_build_tells_the_number_and_enough_arcs_are_silent():
    with pytest.warns(st.UnusualSize, match=r"taper: .* 23 % too large, .* 2 %"):
        st.build(tail="continuum", segments=2, taper=CONE, functions=["energy"], compiled=False)
    scene = parse_scene({"kind": "continuum", "segments": 8, "taper": CONE}, "x")
    warn_of_even_arcs({"scene": scene_to_dict(scene)}, scene.parameters, 1)

"""The paper's figures: numbers that independent computations gave must come out of the models."""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from examples.paper import swing
from tests.support import zoo
from tests.support.models import model_folder
from tests.support.rows import row

# deg, articulated less continuum, Fig. 8b
DIFFERENCE = {2: -0.148, 4: -0.400, 8: -0.333, 16: -0.211, 32: -0.120}
THIN = {"link_inertia": swing.THIN}
ZOO = {None: "arcs1", 1: "m1_n1", 3: "m1_n3"}


@cache
def motion(links, thin=False):
    """Yaw (deg) of the torso in Sect. 4.1's motion, of the continuum for no links."""
    # the number of links is the point of the figure: models of H alone
    own = None if links in ZOO else model_folder(1, links, functions=["mass_matrix"])
    model = zoo.model(ZOO[links]) if own is None else st.load(own)
    return swing.yaw_motion(model.with_parameters(**THIN) if thin else model)


def difference(links, thin=False):
    """Final yaw (deg), articulated less continuum."""
    return motion(links, thin)[-1] - motion(None)[-1]


def test_tails_turn_the_torso_as_in_fig_8():
    """Four links differ most from the continuum, by less than half a degree."""
    assert motion(None)[0] == 0.0
    assert motion(None)[-1] == pytest.approx(-21.450, abs=1e-3)
    assert np.all(np.diff(motion(None)) < 0)
    for links, expected in DIFFERENCE.items():
        with row(links):
            assert difference(links) == pytest.approx(expected, abs=1e-3)
    sizes = {links: abs(difference(links)) for links in (2, 3, 4, 5, 8)}
    assert max(sizes, key=sizes.get) == swing.SHOWN
    assert sizes[swing.SHOWN] < 0.5


def test_thin_links_tend_to_the_continuum_and_thick_ones_keep_their_thickness():
    coarse, fine = (difference(links, thin=True) for links in (128, 256))
    assert coarse / fine == pytest.approx(2, abs=0.05)
    assert difference(256) - fine == pytest.approx(-0.0030, abs=1e-4)

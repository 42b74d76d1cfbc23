"""Airborne rates of tails with segments of their own, tilted mounts, springs, damping and stops, of
arcs, and of links and arcs in one tail.
"""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.scene.signatures.table import AIRBORNE
from tests.references.airborne import along as exact_along
from tests.references.body_set import Animal, Arc, Link
from tests.references.passive import PassiveTail
from tests.support.elastic import ALL
from tests.support.own_tails import (
    ARC_BODIES,
    BOTH,
    LINK_BODIES,
    TAILS,
    TILT,
    VALUES,
    animal,
    folder_of_tables,
)

from .test_derivatives import ROUNDING, along, blocks, condition, row_blocks, worst

OTHERS = ["mass_matrix", "momentum", "forward_dynamics"]
ELASTIC = ALL | {"tail_stop_width": 0.4}
EVEN = {"tail_mass": 0.003, "tail_length": 0.16}
INERTIA = (3e-8, 2e-9, 4e-8)
CHAIN = {"kind": "articulated", "segments": 2, "links": 2}
CHAIN_BODIES = ([Link(0.003 / 4, 0.04, 0.02, INERTIA)] * 2,) * 2
ARCS = {"kind": "continuum", "segments": 4, "samples": 1}
ARCS_BODIES = (Arc(0.003 / 4, 0.04),) * 4
MIXED = {"kind": "mixed", "segments": BOTH[:2], "samples": 3}
MIXED_BODIES = (ARC_BODIES[0], LINK_BODIES[1])
# tables, other parameters, and the tail as bodies; no tables: those of ``own_tails``
CASES = {
    "links": (None, {"mount_angles": TILT}),
    "arcs": (None, {"mount_angles": TILT} | ELASTIC),
    "mixed": (MIXED, {"mount_angles": TILT} | ELASTIC),
    "both": (None, {"mount_angles": TILT} | ELASTIC),
    "tilted": (
        CHAIN | {"weightless": True},
        {"link_inertia": INERTIA, "mount_angles": TILT} | EVEN,
    ),
    "elastic": (CHAIN, {"link_inertia": INERTIA} | EVEN | ELASTIC),
    "many arcs": (ARCS, {"tail_damping": 2e-4} | EVEN),
}
BODIES = {"tilted": CHAIN_BODIES, "elastic": CHAIN_BODIES}
BODIES |= {"many arcs": ARCS_BODIES, "mixed": MIXED_BODIES}
SLOW = ("arcs", "both", "many arcs")


@pytest.fixture(
    scope="module",
    params=[pytest.param(n, marks=pytest.mark.slow) if n in SLOW else n for n in CASES],
)
def name(request):
    """A kind of tail."""
    return request.param


@cache
def loaded(name):
    """Its compiled model."""
    tables, parameters = CASES[name]
    wanted = {"functions": [*AIRBORNE, *OTHERS], "emission": "loops"}
    return st.load(folder_of_tables(tables or TAILS[name][0], parameters, **wanted))


@pytest.fixture(scope="module")
def model(name):
    return loaded(name)


@pytest.fixture(scope="module")
def reference(name):
    """The same animal as a set of bodies, and the forces of its passive parts."""
    parameters = CASES[name][1]
    passive = PassiveTail(parameters, loaded(name).nv - 6)
    if name in TAILS:
        return animal(name, True), passive
    angles = parameters.get("mount_angles", (0.0, 0.0, 0.0))
    return Animal(segments=BODIES[name], mount_angles=angles, **VALUES), passive


def calls(model, count=1):
    """Arguments of calls; weights are of the order of one over each rate's size."""
    rng, nt = np.random.default_rng(43), model.nv - 6
    sizes = np.repeat([1, 10, 500, 20], [4, nt, nt, 3])
    for _ in range(count):
        quaternion, bends, bend_rates = (rng.normal(size=size) for size in (4, nt, nt))
        yield {
            "x": np.concatenate([quaternion, 0.6 * bends, 4 * bend_rates]),
            "tau": 1e-4 * rng.normal(size=nt),
            "angular": 2e-4 * rng.normal(size=3),
            "weights": rng.normal(size=len(sizes)) / sizes,
        }


def test_rates_and_slopes_are_those_of_the_whole_animal(model, reference):
    """Along a direction in which everything moves, by differences of 60 digits."""
    nt = model.nv - 6
    units = np.repeat([1.0, 1.0, 10.0, 1e-3], [4, nt, nt, nt])
    for k, arguments in enumerate(calls(model)):
        x, tau, angular, weights = arguments.values()
        u = units * np.random.default_rng(k).normal(size=len(units))
        y, J, H = model.airborne_rates_hessian(*arguments.values())
        expected, first, second = exact_along(*reference, x, tau, angular, u)
        limit = ROUNDING * condition(model, x)
        for rows in row_blocks(nt):
            assert np.abs(y[rows] - expected[rows]).max() <= limit * np.abs(expected[rows]).max()
            scale = (np.abs(J[rows]) @ np.abs(u)).max()
            assert np.abs(J[rows] @ u - first[rows]).max() <= limit * scale
        scale = np.abs(u) @ np.abs(H) @ np.abs(u)
        assert abs(u @ H @ u - weights @ second) <= limit * scale


def test_derivatives_are_those_of_a_complex_step(model):
    tail = model.nv - 6
    for arguments in calls(model):
        y, J, H = model.airborne_rates_hessian(*arguments.values())
        limit = ROUNDING * condition(model, arguments["x"])
        expected = along(model, "airborne_rates", arguments)["y"]
        assert worst(J, expected, row_blocks(tail), blocks(tail)) <= limit
        steps = along(model, "airborne_rates_derivatives", arguments)["J"]
        expected = np.einsum("r,rck->ck", arguments["weights"], steps.reshape(len(y), *H.shape))
        assert worst(H, expected, blocks(tail), blocks(tail)) <= limit


def test_all_three_functions_and_batches_give_the_same(model):
    rows = [*calls(model, 9)]
    alone = [model.airborne_rates_hessian(*arguments.values()) for arguments in rows]
    stacked = [np.array([arguments[key] for arguments in rows]) for key in rows[0]]
    together = model.airborne_rates_hessian(*stacked)
    y, J = model.airborne_rates_derivatives(*stacked[:3])
    others = (model.airborne_rates(*stacked[:3]), y, J, *together)
    for found, which in zip(others, (0, 0, 1, 0, 1, 2), strict=True):
        expected = np.array([results[which] for results in alone])
        assert np.abs(found - expected).max() <= 1e-11 * np.abs(expected).max()

"""Forward dynamics by segments, as articulated bodies: they mean what H and C mean, to rounding."""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.plain import FUNCTIONS
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.targets.c.form import RULE, fastest
from tests.functions.test_columns import arguments, assert_same_acceleration, outputs
from tests.references.exact_chain import ExactChain
from tests.references.metrics import block_error, equilibrated_condition
from tests.references.parameters import TABLE_1, random_states
from tests.support.models import model_folder

SIZES = [(1, 1), (1, 3), (2, 1), (2, 3), (4, 2), (9, 1)]
COILS = ((0.7, 0.4), (1.5, -0.2))  # rad at every joint: turns that lie on one another
FUNCTION = "forward_dynamics"


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", ["forward_dynamics", "forward_dynamics_external"])
def test_segments_give_the_same_acceleration(size, name):
    assert_same_acceleration(size, name, "segments")


def test_what_needs_the_matrix_goes_in_lanes():
    for name in ("forward_dynamics_jvp", "mass_matrix", "pfl"):
        assert assemble(CATALOGUE[name], Tail(3, 2), "segments") == assemble(
            CATALOGUE[name], Tail(3, 2), "lanes"
        )


@pytest.mark.parametrize(
    ("size", "form"), [((1, 64), "lanes"), ((3, 4), "lanes"), ((4, 4), "segments")]
)
@pytest.mark.parametrize("name", [FUNCTION, "forward_dynamics_derivatives"])
def test_long_tails_of_several_segments_go_by_segments(name, size, form):
    assert fastest(CATALOGUE[name], Tail(*size))[0] == form


def test_derivatives_by_segments_are_those_of_long_segments_too():
    name, tail = "forward_dynamics_derivatives", Tail(1, 96)
    plain, segments = (assemble(CATALOGUE[name], tail, form) for form in ("lanes", "segments"))
    given = arguments(plain)
    expected, found = outputs(plain, given), outputs(segments, given)
    for matrix, wanted in expected.items():
        assert np.abs(found[matrix] - wanted).max() <= 1e-11 * np.abs(wanted).max()


@pytest.mark.parametrize("name", ["forward_dynamics", "mass_matrix"])
def test_a_continuum_has_one_form_of_dynamics(name):
    tail = Tail(3, 2, "continuum")
    assert assemble(FUNCTIONS[name], tail, "segments") == assemble(FUNCTIONS[name], tail)


@cache
def chain(size):
    """The exact chain of one size."""
    return ExactChain(TABLE_1, *size)


def states(segments, kind):
    """Two tuples (q, v, v_dot, tau)."""
    found = list(
        zip(*random_states(segments, 11, 2, "random" if kind == "coiled" else kind), strict=True)
    )
    if kind == "coiled":
        for (q, *_), coil in zip(found, COILS, strict=True):
            q[7:] = np.tile(coil, segments)
    return found


def worst_error(size, kind):
    """Largest error of v_dot, and of that over the condition number of the scaled H, against 40
    digits.
    """
    model, exact, found = (
        st.load(model_folder(*size, functions=[FUNCTION], emission="segments")),
        chain(size),
        [],
    )
    for q, v, _, tau in states(size[0], kind):
        error = block_error(model.forward_dynamics(q, v, tau), exact.forward_dynamics(q, v, tau))
        found.append((error, error / equilibrated_condition(exact.mass_matrix(q))))
    return np.max(found, axis=0)


slow = pytest.mark.slow
EXACT_SIZES = [
    (1, 3),
    (3, 4),
    (8, 2),
    *(pytest.param(s, marks=slow) for s in ((2, 16), (6, 6), (8, 16), (20, 4))),
]


@pytest.mark.parametrize("size", EXACT_SIZES, ids=lambda size: f"m{size[0]}_n{size[1]}")
@pytest.mark.parametrize("kind", ["random", "straight", "folded", "coiled"])
def test_accelerations_are_exact_to_rounding(size, kind):
    error, scaled = worst_error(size, kind)
    assert scaled <= 5e-15
    assert error <= 1e-13  # no matrix is formed whose condition number counts


def signs(segments, **changed):
    """Which pivots are positive: two of each segment from the last one on, then six of the
    torso.
    """
    found = Run(segments, Numbers(np), arguments(segments) | changed).guards
    assert [status for status, _ in found] == ["NOT_POSITIVE_DEFINITE"] * 12
    return [value > 0 for _, value in found]


def test_every_pivot_is_guarded():
    segments = assemble(FUNCTIONS[FUNCTION], Tail(3, 2), "segments")
    assert all(signs(segments))
    assert signs(segments, torso_mass=[-1e3])[:6] == [True] * 6 and not all(
        signs(segments, torso_mass=[-1e3])
    )
    assert signs(segments, tail_mass=[-1.0], link_inertia=[-1.0] * 3)[:2] == [False] * 2


@pytest.mark.parametrize(
    ("size", "options", "emission"),
    [
        ((1, 3), {}, "straight"),
        ((2, 4), {}, "lanes"),
        ((2, 4), {"emission": "segments"}, "segments"),
        ((8, 16), {}, "segments"),
        ((8, 16), {"emission": "lanes"}, "lanes"),
        ((8, 16), {"emission": "loops"}, "loops"),
    ],
)
def test_the_manifest_tells_how_v_dot_comes_about(size, options, emission):
    model = st.load(model_folder(*size, functions=[FUNCTION, "energy"], **options), compiled=False)
    assert model.manifest["functions"][FUNCTION]["emission"] == emission
    assert model.manifest["functions"]["energy"]["emission"] in ("straight", "loops")


@pytest.mark.parametrize(
    ("size", "form"),
    [((1, 9), "straight"), ((3, 2), "straight"), ((4, 1), "straight"), ((1, 10), "lanes")],
)
def test_straight_lines_beside_lanes_end_at_a_length(size, form):
    assert fastest(FUNCTIONS[FUNCTION], Tail(*size))[0] == form


@pytest.mark.parametrize("emission", ["auto", "loops"])
def test_the_manifest_tells_the_rule_where_forms_are_chosen(emission):
    folder = model_folder(1, 1, functions=[FUNCTION], emission=emission)
    manifest = st.load(folder, compiled=False).manifest
    assert manifest.get("forms") == (RULE if emission == "auto" else None)


@pytest.mark.parametrize(
    "options", [{"real": "float"}, {"profile": "reproducible"}, {"baked": True}]
)
def test_segments_serve_every_kind_of_scene(options):
    model = st.load(model_folder(3, 4, functions=[FUNCTION], emission="segments", **options))
    q, v, _, tau = states(3, "random")[0]
    error = block_error(
        model.forward_dynamics(q, v, tau), chain((3, 4)).forward_dynamics(q, v, tau)
    )
    assert error <= (1e-3 if "real" in options else 1e-13)


def test_contact_goes_by_segments_too():
    options = {"functions": ["contact_dynamics"], "contacts": ["tail", "torso"]}
    models = [
        st.load(model_folder(3, 2, emission=form, **options)) for form in ("segments", "loops")
    ]
    q, v, _, tau = states(3, "random")[0]
    q[2] = 0.02
    segments, loops = (model.contact_dynamics(q, v, tau, np.zeros(14)) for model in models)
    assert np.abs(loops[2]).max() > 0
    for found, expected in zip(segments, loops, strict=True):
        assert np.abs(found - expected).max() <= 1e-11 * np.abs(expected).max()

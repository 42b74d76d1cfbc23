"""Batches of contact: states side by side, pressing on the ground or not, give what each of them
gives alone.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import serpentail
from serpentail.model.kernel import Kernel
from serpentail_codegen.targets.c.batch import STATES

from .ground import ARGUMENTS, TOUCHING, model, pressing, states
from .tails import evaluated
from .test_compiled import every_form


@pytest.fixture
def in_lanes(monkeypatch):
    """Fails if states are evaluated one by one."""
    monkeypatch.setattr(Kernel, "_each", lambda *_: pytest.fail("one by one"))


def arrays(values, name, *index):
    """The arguments of one function, of all states or of some."""
    return [values[argument][index] for argument in ARGUMENTS[name]]


def alone(model, name, values):
    """Every state by a call of its own."""
    count = len(values["q"])
    return np.array([evaluated(model, name, arrays(values, name, k)) for k in range(count)])


def assert_alike(found, expected):
    """Within rounding of each number's largest value."""
    scale, digits = np.abs(expected).max(axis=0), np.finfo(expected.dtype).eps
    assert (np.abs(found - expected) <= 3e3 * digits * scale).all()


@every_form
@pytest.mark.parametrize("name", ARGUMENTS)
def test_mixed_contacts_give_what_each_state_gives_alone(tail, emission, real, name, in_lanes):
    found = model(*tail, emission=emission, real=real)
    values = states(found, (TOUCHING * 11)[:31])
    presses = [pressing(found, values, k) for k in range(6)]
    assert presses[2] == presses[5] == 0 and presses[0] > 0
    expected = alone(found, name, values)
    for count in (STATES[real], len(expected)):
        assert_alike(evaluated(found, name, arrays(values, name, slice(count))), expected[:count])


@pytest.mark.parametrize("friction", ["box", "smooth", "paper"])
def test_every_law_of_friction_has_batches(friction, in_lanes):
    found, name = model(friction=friction), "contact_dynamics"
    values = states(found, TOUCHING * 3, seed=4)
    assert_alike(evaluated(found, name, arrays(values, name)), alone(found, name, values))


@pytest.mark.parametrize("tail", [("articulated", 2, 2), ("continuum", 2, None)])
@pytest.mark.parametrize("name", ARGUMENTS)
def test_the_reproducible_profile_gives_the_same_bits(tail, name, in_lanes):
    found = model(*tail, profile="reproducible", emission="loops")
    values = states(found, TOUCHING * 3)
    together = evaluated(found, name, arrays(values, name))
    assert np.array_equal(together, alone(found, name, values))


@settings(deadline=None, max_examples=60)
@given(
    touching=st.lists(st.sampled_from(TOUCHING), min_size=8, max_size=17),
    seed=st.integers(0, 2**32 - 1),
)
def test_forces_are_those_of_the_law_in_any_mixture(touching, seed):
    """Eq. 36 and Coulomb's cone, from the places and velocities of the points alone."""
    found = model()
    values = states(found, touching, seed)
    p = found.parameters
    places, moves = found.contact_points(*arrays(values, "contact_points"))
    _, rates, forces = found.contact_dynamics(*arrays(values, "contact_dynamics"))
    depth = np.maximum(-places[..., 2], 0)
    normal = p["K_n"] * np.sqrt(depth) * np.maximum(depth - p["D_n"] * moves[..., 2], 0)
    np.testing.assert_allclose(forces[..., 2], normal, rtol=1e-9, atol=1e-12)
    bristles = values["bristles"].reshape(*depth.shape, 2)
    trial = -p["K_f"] * (bristles + p["D_f"] * moves[..., :2])
    size, bound = np.linalg.norm(trial, axis=-1), p["mu"] * normal
    friction = trial * np.where(size > bound, bound / size, 1)[..., None]
    np.testing.assert_allclose(forces[..., :2], friction, rtol=1e-7, atol=1e-12)
    relaxing = -(friction + p["K_f"] * bristles) / (p["D_f"] * p["K_f"])
    found_rates = rates.reshape(*depth.shape, 2)
    np.testing.assert_allclose(found_rates, relaxing, rtol=1e-7, atol=1e-12)


def test_a_state_that_is_not_finite_is_named():
    found, values = model(), states(model(), TOUCHING * 4)
    values["bristles"][7, 3] = np.nan
    with pytest.raises(serpentail.StateError, match=r"bristles\[3\] of state 7: value nan"):
        found.contact_dynamics(*arrays(values, "contact_dynamics"))

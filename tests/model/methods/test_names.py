"""Models: every function takes any array of numbers, alone or in batches, and refuses the rest by
name.
"""

import subprocess

import numpy as np
import pytest

import serpentail as st

from .calls import CALLS, POINTS, SIZES, assert_same, call, folder, state


@pytest.fixture
def no_process(monkeypatch):
    """Make every attempt to start a process, so every compilation, fail the test."""

    def refuse(*_args, **_options):
        raise AssertionError("a process was started")

    monkeypatch.setattr(subprocess, "Popen", refuse)


# Names


def test_aliases_of_the_field(model):
    s = state()
    assert_same(model.crba(s["q"]), model.mass_matrix(s["q"]))
    assert_same(model.nle(s["q"], s["v"]), model.bias_force(s["q"], s["v"]))
    assert_same(
        model.rnea(s["q"], s["v"], s["v_dot"]), model.inverse_dynamics(s["q"], s["v"], s["v_dot"])
    )
    for load in (None, s["f_ext"]):
        assert_same(
            model.aba(s["q"], s["v"], s["tau"], load),
            model.forward_dynamics(s["q"], s["v"], s["tau"], load),
        )


@pytest.mark.parametrize("name", [name for name in CALLS if name != "mass_matrix"])
def test_function_left_out_is_named_with_the_remedy(small, name):
    with pytest.raises(st.ModelError) as caught:
        call(small, name, state())
    assert str(caught.value) == (
        f"small was generated without {name!r} (it has mass_matrix): add it to `functions` of the "
        "scene, "
        "then generate it again"
    )


def test_casadi_knows_the_same_functions(small):
    with pytest.raises(st.ModelError, match="small was generated without 'energy'"):
        _ = small.casadi.energy
    assert not hasattr(small.casadi, "_repr_html_")
    assert small.casadi.mass_matrix.name_in() == ["q"]


def test_external_force_takes_loads_by_name(model):
    load = model.external_force(
        force=(1, 2, 3), moment=[4, 5, 6], tail=np.arange(7, 7 + 3 * POINTS).reshape(-1, 3)
    )
    np.testing.assert_array_equal(load, np.arange(1.0, 7 + 3 * POINTS))
    np.testing.assert_array_equal(model.external_force(), np.zeros(SIZES["f_ext"]))


@pytest.mark.parametrize(
    "loads", [{"force": (1, 2)}, {"moment": 1.0}, {"tail": np.zeros(3 * POINTS)}, {"force": "xyz"}]
)
def test_external_force_names_a_wrong_load(model, loads):
    with pytest.raises(st.StateError, match=next(iter(loads))):
        model.external_force(**loads)


# Parameters


def test_parameters_change_without_a_compiler(model, no_process):
    """Mass and inertia twice as large make H twice as large, bit for bit."""
    double = {name: 2 * model.parameters[name] for name in ("torso_mass", "tail_mass")}
    double["torso_inertia"] = 2 * np.array(model.parameters["torso_inertia"])
    s = state()
    for heavy in (st.load(folder(), parameters=double), model.with_parameters(**double)):
        np.testing.assert_array_equal(heavy.mass_matrix(s["q"]), 2 * model.mass_matrix(s["q"]))
        np.testing.assert_array_equal(
            heavy.bias_force(s["q"], s["v"]), 2 * model.bias_force(s["q"], s["v"])
        )
        assert heavy.parameters["link_inertia"] == tuple(
            2 * np.array(model.parameters["link_inertia"])
        )


def test_parameters_given_late_are_those_of_a_scene(model):
    changes = {"tail_mass": 0.02, "tail_mount": [0.01, -0.05, 0.002], "gravity": 1.6}
    other = st.load(folder(parameters=changes))
    for name in CALLS:
        assert_same(
            call(model.with_parameters(**changes), name, state()), call(other, name, state())
        )


def test_first_model_keeps_its_parameters(model):
    before, expected = dict(model.parameters), model.mass_matrix(state()["q"])
    assert (model.with_parameters(tail_mass=1.0).mass_matrix(state()["q"]) != expected).any()
    assert dict(model.parameters) == before
    np.testing.assert_array_equal(model.mass_matrix(state()["q"]), expected)


def test_changes_of_parameters_add_up(model):
    light = model.with_parameters(tail_mass=0.001).with_parameters(link_radius=0.01)
    assert light.parameters == model.with_parameters(tail_mass=0.001, link_radius=0.01).parameters
    given = light.with_parameters(link_inertia=(1e-6, 1e-8, 1e-6)).with_parameters(tail_mass=0.002)
    assert (
        given.parameters["link_inertia"] == (1e-6, 1e-8, 1e-6)
        and "link_radius" not in given.parameters
    )
    assert given.with_parameters(link_radius=0.01, tail_mass=0.001).parameters == light.parameters


def test_wrong_parameters_are_refused(model):
    for attempt in (lambda p: st.load(folder(), p), lambda p: model.with_parameters(**p)):
        with pytest.raises(st.ModelError) as caught:
            attempt({"tail_mas": 1, "gravity": -1})
        assert "did you mean 'tail_mass'?" in str(caught.value) and "gravity: value -1" in str(
            caught.value
        )


def test_baked_model_has_the_same_values_and_refuses_others(model):
    baked = st.load(folder(baked=True))
    for name in CALLS:
        for found, expected in zip(
            call(baked, name, state()), call(model, name, state()), strict=True
        ):
            np.testing.assert_allclose(
                found, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max()
            )
    assert baked.with_parameters().parameters == model.parameters
    for attempt in (
        lambda: baked.with_parameters(gravity=1.6),
        lambda: st.load(baked.folder, {"gravity": 1.6}),
    ):
        with pytest.raises(st.ModelError, match="baked = false"):
            attempt()

"""Flights of elastic tails in lanes: motion and books are those of each run alone."""

import numpy as np
import pytest

import serpentail as st
from tests.support.elastic import ALL, FUNCTIONS, SIZES, bent, elastic_model

METHODS = {"tsit5": {"rtol": 1e-9}, "rk4": {"step": 1e-4}}


def flights(model, runs, method, **settings):
    """Some flights of bent tails."""
    rng, (q, v) = np.random.default_rng(4), bent(model, 0.0)
    q = np.tile(q, (runs, 1))
    q[:, 7:] = rng.uniform(-0.5, 0.5, (runs, model.layout.nt))
    how = {"method": method, "t_span": 0.1} | METHODS[method] | settings
    return q, v, how


@pytest.mark.usefixtures("any_number_is_many")
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", SIZES)
def test_each_lane_has_springs_and_damping_of_its_own(name, method):
    model, runs = elastic_model(*SIZES[name], ALL, functions=FUNCTIONS), 9
    q, v, how = flights(model, runs, method)
    rng = np.random.default_rng(5)
    own = {"tail_stiffness": rng.uniform(1e-3, 1e-2, (runs, 4))}
    own["tail_damping"] = rng.uniform(1e-5, 1e-3, runs)
    many = st.simulate(model, q, v, parameters=own, **how)
    assert many.info["abreast"] == 8 and many.errors == [None] * runs
    for k in range(runs):
        alone = model.with_parameters(**{n: x[k] for n, x in own.items()})
        run = st.simulate(alone, q[k], v, **how)
        np.testing.assert_allclose(many[k].q, run.q, atol=1e-8)
        found, expected = (motion.info["work_J"]["damping"] for motion in (many[k], run))
        assert found == pytest.approx(expected, rel=1e-7) and expected < -1e-6
        assert many[k].info["imbalance"]["relative"] < 1e-6


@pytest.mark.usefixtures("any_number_is_many")
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("options", [{"baked": True}, {"real": "float"}], ids=["baked", "float"])
def test_baked_and_single_models_keep_the_same_books(options, method):
    double = elastic_model(2, 2, ALL, functions=FUNCTIONS)
    model = elastic_model(2, 2, ALL, functions=FUNCTIONS, **options)
    single = options.get("real") == "float"
    q, v, how = flights(double, 17, method, **({"rtol": 1e-4} if method == "tsit5" else {}))
    many = st.simulate(model, q, v, **how)
    assert many.info["abreast"] >= 8
    for k in (0, 16):
        one, run = st.simulate(model, q[k], v, **how), st.simulate(double, q[k], v, **how)
        for found in (many[k], one):
            np.testing.assert_allclose(found.tail, run.tail, atol=2e-4 if single else 1e-8)
            lost = run.info["work_J"]["damping"]
            assert found.info["work_J"]["damping"] == pytest.approx(lost, rel=1e-3)
            assert found.info["warnings"] == []

"""Bad calls and scenes are answered or refused, drops gain no energy, and what once broke stays
mended.
"""

import random
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from serpentail.model.sizes import UNLIKE as UNLIKE_FROM
from serpentail.model.sizes import disparity
from stress import call_fuzz, drops, scene_fuzz, stress_plots
from stress.call_fuzz import Fault, Target
from stress.figures import Figure, table
from stress.poses import Point
from stress.subjects import Errors, Subject, changed, exact_of, state
from tests.references.metrics import mass_matrix_error
from tests.support.models import model_folder

SCENES = sorted((Path(__file__).parents[2] / "scenes").glob("*.toml"))
slow_count = pytest.param(10_000, marks=pytest.mark.slow)


@pytest.fixture(scope="module")
def standing():
    return st.load(model_folder(1, 3, contacts=["feet", "tail"], functions="all"))


@pytest.fixture(scope="module")
def lying():
    return st.load(model_folder(2, None, contacts=["torso"]))


@pytest.mark.parametrize("count", [400, slow_count])
def test_random_calls_are_answered_or_refused(standing, lying, count, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for seed, model in enumerate((standing, lying)):
        assert call_fuzz.fuzz(call_fuzz.targets(model, tmp_path), count, seed) == []


@pytest.mark.parametrize(
    ("found", "passed"), [(1.0, True), (1.1, False), (np.nan, False), (np.inf, False)]
)
def test_a_figure_beyond_its_limit_fails(found, passed):
    figure = Figure("it", found, 1.0)
    assert (figure.passed, figure.row()["passed"], "**FAILED**" in table([figure])) == (
        passed,
        passed,
        not passed,
    )


def test_plots_are_drawn(tmp_path):
    errors = [Errors(1e-16, 0.0, 1e-15, condition) for condition in (3.0, 1e4)]
    swept = [
        Point(tail, bend, e)
        for tail in ("one", "two")
        for bend, e in zip((0.0, 1.0), errors, strict=True)
    ]
    figures = [
        Figure("v_dot", 1e-16, 5e-15, "cond(H) 1e4"),
        Figure("faults", 0, 0),
        Figure("drift", 0.0, 1e-6),
    ]
    stress_plots.draw({"Part": figures}, swept, tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "bends.png",
        "condition.png",
        "margins.png",
    ]


@pytest.mark.parametrize("result", [np.array([1.0, np.nan]), (1.0, (np.inf,))])
def test_the_fuzz_sees_results_that_are_no_numbers(result):
    found = call_fuzz.fuzz([Target("it", lambda x: result, {"x": 1.0})], 5, 1)
    assert [fault.kind for fault in found] == ["no number"]


def test_the_fuzz_sees_bare_errors():
    found = call_fuzz.fuzz([Target("it", lambda x: {}["absent"], {"x": 1.0})], 5, 1)
    assert [(fault.kind, fault.target) for fault in found] == [("bare error", "it")]
    assert isinstance(found[0], Fault)


def test_an_unusual_number_in_a_scene_is_no_fault(standing, tmp_path, monkeypatch):
    """Warnings are errors here, as in the stress test."""
    path = tmp_path / "bent.toml"
    text = (SCENES[0].parent / "kick.toml").read_text(encoding="utf-8")
    assert "\nheight = " in text
    path.write_text(text.replace("\nheight = ", "\nbends = 11.6\nheight = "), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    with pytest.warns(st.UnusualSize, match="bends"):
        scene_fuzz.made_ready(standing, path)
    monkeypatch.setattr(scene_fuzz, "mutated", lambda text, dice: text)
    assert scene_fuzz.faults([path], 1, random.Random(1), tmp_path, standing) == []


@pytest.mark.parametrize("count", [300, slow_count])
def test_mutated_scene_files_are_read_or_refused(count, tmp_path, monkeypatch):
    functions = ["forward_dynamics", "rollout", "energy", "momentum", "pfl"]
    model = st.load(model_folder(3, 4, contacts=["feet", "tail", "torso"], functions=functions))
    monkeypatch.chdir(tmp_path)
    assert scene_fuzz.faults(SCENES, count, random.Random(count), tmp_path, model) == []


@pytest.mark.parametrize("method", ["ros34pw2", "tsit5", "dop853"])
def test_a_drop_gains_no_energy(method):
    """The drop whose samples before the landing once had two thirds too much; dop853 once gave it
    up.
    """
    model, rng = drops.falling(1, None), np.random.default_rng(11)
    for _ in range(26):
        q, v = drops.start(model, rng)
        legs = st.Legs.fixed(rng.uniform(2, 4.5), rng.uniform(-1.5, 1))
    settings = {
        "controller": st.Damping(1e-4),
        "legs": legs,
        "t_span": drops.DURATION,
        "output_step": 0.01,
    }
    assert drops.gain(st.simulate(model, q, v, method=method, **settings)) <= drops.GAIN


UNLIKE = {
    "a tail of 1 km": {"tail_length": 1e3},
    "a tail of 1 um": {"tail_length": 1e-6},
    "a torso of 1 mg": {"torso_mass": 1e-6, "torso_inertia": (1e-12, 1e-12, 1e-12)},
    "a mount 1 km away": {"tail_mount": (1e3, -1e3, 1e3)},
}


@pytest.mark.filterwarnings("ignore::serpentail.errors.UnusualSize")
@pytest.mark.parametrize("change", UNLIKE.values(), ids=UNLIKE)
def test_bodies_of_unlike_size_are_told(lying, change):
    with pytest.warns(
        st.UnlikeBodies,
        match=r"differ by a factor of .*: H may be off by as many roundings; are the",
    ):
        other = lying.with_parameters(**change)
    with pytest.warns(st.UnlikeBodies):
        st.load(lying.folder, parameters=change)
    assert other.parameters["tail_mass"] == lying.parameters["tail_mass"]


@pytest.mark.slow
def test_the_warning_is_true(lying):
    """It comes where H is off by more than 1e-12, and an error is never more than it says."""
    off = {}
    for name, change in UNLIKE.items():
        of = changed(Subject("", lying, None), **change)
        straight = [
            errors_of_mass_matrix(of, state(of, np.random.default_rng(k), np.zeros(4))[0])
            for k in range(5)
        ]
        off[name] = max(straight) / disparity(of.model.parameters)
    assert max(off.values()) < np.finfo(float).eps
    worst = max(off, key=lambda name: off[name] * disparity(lying.parameters | UNLIKE[name]))
    assert off[worst] * disparity(lying.parameters | UNLIKE[worst]) > 1e-12


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::serpentail.errors.UnusualSize")
@pytest.mark.parametrize("name", ["standing", "lying"])
def test_bodies_without_the_warning_keep_their_digits(request, name):
    """Random bodies as unlike as may be without it."""
    of, rng, quiet = Subject("", request.getfixturevalue(name), None), np.random.default_rng(4), 0
    while quiet < 12:
        heavy, long, wide = (
            10 ** rng.uniform(-4, 4),
            10 ** rng.uniform(-3, 3),
            10 ** rng.uniform(-3, 3),
        )
        change = {
            "tail_mass": 3.5e-3 * heavy,
            "tail_length": 0.2 * long,
            "tail_mount": (0, -0.04 * wide, 4e-3 * wide),
        }
        if 1e2 < disparity(of.model.parameters | change) < UNLIKE_FROM:
            other, quiet = Subject("", of.model.with_parameters(**change), None), quiet + 1
            for bends in (np.zeros(of.model.nv - 6), rng.uniform(-1, 1, of.model.nv - 6)):
                assert errors_of_mass_matrix(other, state(other, rng, bends)[0]) < 1e-12


def errors_of_mass_matrix(of, q):
    """Error of H against 30 digits, in units of its diagonal."""
    return mass_matrix_error(of.model.mass_matrix(q), exact_of(of.model).mass_matrix(q))


def test_vjp_of_a_model_with_contacts_is_that_of_flight(standing):
    flight = st.load(model_folder(1, 3, functions=["forward_dynamics_vjp"]))
    rng = np.random.default_rng(5)
    arguments = [rng.normal(size=n) for n in (flight.nq, flight.nv, 2, flight.nv)]
    for found, expected in zip(
        standing.forward_dynamics_vjp(*arguments),
        flight.forward_dynamics_vjp(*arguments),
        strict=True,
    ):
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"method": np.zeros(2)}, "method"),
        ({"stop_at": np.zeros((2, 2))}, "stop_at"),
        ({"method": "rk4", "step": 1e-320}, "step 1e-320: too short"),
        ({"output_step": 1e-320}, "output_step 1e-320: more than"),
        (
            {"method": "lsoda", "t_span": 1e-320},
            "output_step .*: too short to move the time: give 1e-100",
        ),
        (
            {"t_span": (1e10, 1e10 + 4e-6)},
            "output_step .*: too short to move the time: give 2.2e-06 s",
        ),
        ({"method": "ros34pw2", "rtol": 1e-320}, "too close to rounding errors: give 2.2e-14"),
        ({"method": "dop853", "rtol": 1e-15}, "rtol 1e-15: too close to rounding"),
        (
            {"method": "ros34pw2", "most_step": 1e-200},
            "most_step 1e-200: too short to move the time",
        ),
    ],
)
def test_simulations_that_cannot_be_are_refused(standing, settings, words):
    q = np.array([0, 0, 0.3, 1, 0, 0, 0, 0, 0.0])
    with pytest.raises(st.SimulationError, match=words):
        st.simulate(
            standing, q, np.zeros(8), legs=st.Legs.fixed(3.6, -0.3), **({"t_span": 0.01} | settings)
        )


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda model: st.Legs.ramp(3.6, (-0.3, -1.0), 0.4, 1e-320), "takes inf s"),
        (
            lambda model: st.Reference([0.0, 1.0], [1, [2, 3]]),
            "Reference: angles: type list: needs real numbers",
        ),
        (
            lambda model: st.Pfl(model, ([0.0, 1.0], np.zeros((2, 2))), 10**60),
            "Pfl: kp: value 10{60}: needs a number from 0",
        ),
        (
            lambda model: st.Pfl(model, np.zeros((2, 3), complex)),
            "Pfl: times: type complex128: needs real numbers",
        ),
        (lambda model: st.Pfl(model, ([0.0], np.zeros((1, 2)))), "Pfl: one node only"),
        (
            lambda model: model.external_force(moment=(0, np.nan, 0)),
            r"external_force: moment\[1\]: value nan: needs a finite number",
        ),
    ],
)
def test_arguments_that_the_fuzz_once_broke_are_refused(standing, call, words):
    with pytest.raises(st.SerpentailError, match=words):
        call(standing)


@pytest.mark.parametrize(
    "call",
    [
        lambda: st.polar_to_bend("x", 1.0),
        lambda: st.polar_to_bend(np.zeros(2), np.zeros(3)),
        lambda: st.polar_to_bend(np.inf, 1.0),
        lambda: st.bend_to_polar(5e-324, 0.0, 1.0, 1.0),
        lambda: st.rotation_matrix(np.zeros(4)),
        lambda: st.rotation_matrix([np.nan, 0, 0, 0]),
        lambda: st.rotation_matrix(np.zeros(3)),
        lambda: st.pitch_roll_yaw(3.0),
    ],
)
def test_conversions_refuse_what_is_no_state(call):
    with pytest.raises(st.StateError):
        call()


@pytest.mark.parametrize("size", [1e-300, 1e-160, 1.0, 1e160, 1e300])
def test_rotations_take_quaternions_of_any_norm(size):
    q = np.array([0.5, 0.5, -0.5, 0.5])
    np.testing.assert_allclose(st.rotation_matrix(q * size), st.rotation_matrix(q), atol=1e-15)

"""Tails of links and arcs: limits, convergence, flights, and what scenes of them may say."""

import zipfile
from functools import cache

import numpy as np
import pytest

import serpentail as st
from serpentail.containers.contents import contents
from serpentail.viewer.shape import shape
from serpentail_codegen.functions.draft import Draft
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.plain import FUNCTIONS
from serpentail_codegen.functions.sweeps.pieces import each_segment, mechanism
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.scene.parse import parse_scene
from serpentail_codegen.scene.shape import Run, Shape
from serpentail_codegen.targets.c.straight import straight_line
from tests.references.metrics import block_error
from tests.support.elastic import ALL
from tests.support.models import folder_of
from tests.support.own_tails import BOTH, TILT, TORSO, states

LINKS = {"kind": "articulated", "links": 3, "length": 0.1, "mass": 0.002}
ARC = {"kind": "continuum", "length": 0.08, "mass": 0.001}
NAMES = ["mass_matrix", "inverse_dynamics", "forward_dynamics", "energy", "momentum", "tail_points"]


@cache
def loaded(folder):
    return st.load(folder)


def model_of(*segments, functions=NAMES, parameters=None, **keys):
    """The model of a mixed tail."""
    table = {"kind": "mixed", "segments": list(segments), "functions": functions, **keys}
    table["parameters"] = {**TORSO, **(parameters or {})}
    return loaded(folder_of(parse_scene(table, "both")))


def pure(kind, *segments):
    """The model of a tail of one kind."""
    table = {"kind": kind, "segments": list(segments), "functions": NAMES, "parameters": TORSO}
    return loaded(folder_of(parse_scene(table, "pure")))


# ---- limits --------------------------------------------------------------------------------------


@pytest.mark.parametrize("first", [True, False], ids=["arc of no mass", "links of no mass"])
def test_what_weighs_nothing_leaves_the_other_kind(first):
    """Of a tail whose last segment weighs 1e-13 of a gram the rest moves as without it."""
    heavy, light = (LINKS, ARC) if first else (ARC, LINKS | {"link_inertia": [0, 0, 0]})
    model = model_of(heavy, light | {"mass": 1e-16})
    alone = pure(heavy["kind"], heavy)
    for q, v, v_dot, _ in states(model.nq):
        force = model.inverse_dynamics(q, v, v_dot)
        expected = alone.inverse_dynamics(q[:-2], v[:-2], v_dot[:-2])
        assert block_error(force[:-2], expected) < 1e-9
        assert np.abs(force[-2:]).max() < 1e-12
        count = len(alone.tail_points(q[:-2]))
        np.testing.assert_allclose(
            model.tail_points(q)[:count], alone.tail_points(q[:-2]), rtol=0, atol=1e-15
        )


def thin(n):
    """A segment of n thin rods."""
    across = 2e-3 / n * (0.08 / n) ** 2 / 12
    own = {"links": n, "length": 0.08, "mass": 0.002, "link_inertia": [across, 0, across]}
    return {"kind": "articulated", **own}


def test_links_converge_to_an_arc():
    """A segment of n thin links turned by a / n each, and an arc bent by a: an error of 1 / n."""
    expected_at = {}
    q, v, v_dot, _ = next(states(11))
    for n in (None, 8, 16, 32):
        own = (
            {
                "link_inertias": [
                    [2e-3 * (0.08 / n) ** 2 / (12 * n), 0, 2e-3 * (0.08 / n) ** 2 / (12 * n)]
                ]
                * n
            }
            if n
            else {}
        )
        second = {"length": 0.08, "mass": 0.002} | own
        second |= {"kind": "articulated", "links": n} if n else {"kind": "continuum"}
        model = (
            model_of(ARC, second)
            if n
            else loaded(
                folder_of(
                    parse_scene(
                        {
                            "kind": "continuum",
                            "segments": [{"length": 0.08, "mass": m} for m in (0.001, 0.002)],
                            "functions": NAMES,
                            "parameters": TORSO,
                        },
                        "arcs",
                    )
                )
            )
        )
        T = np.eye(10)
        T[8:, 8:] /= n or 1  # joints turn by the n-th part
        there = np.concatenate([q[:7], T[6:, 6:] @ q[7:]]), T @ v, T @ v_dot
        expected_at[n] = T.T @ model.inverse_dynamics(*there)
    errors = [block_error(expected_at[n], expected_at[None]) for n in (8, 16, 32)]
    assert errors[0] < 0.2
    assert errors[0] / errors[1] == pytest.approx(2, rel=0.25)
    assert errors[1] / errors[2] == pytest.approx(2, rel=0.15)


# ---- flights -------------------------------------------------------------------------------------


def test_flights_keep_energy_and_momentum():
    """Five seconds, undamped."""
    functions = ["energy", "momentum", "rollout", "forward_dynamics", "implicit", "tail_points"]
    model = model_of(*BOTH, functions=functions, samples=3, parameters={"mount_angles": TILT})
    rng = np.random.default_rng(5)
    q, v = np.zeros(model.nq), 2 * rng.normal(size=model.nv)
    q[3], q[7:] = 1, 0.3 * rng.normal(size=8)
    springs = model_of(
        *BOTH,
        functions=functions,
        samples=3,
        parameters={"tail_stiffness": 2e-3, "mount_angles": TILT},
    )
    run = st.simulate(springs, q, v, t_span=5.0, method="tsit5", rtol=1e-11)
    assert np.ptp(run.energy) < 1e-7 * run.kinetic.max()
    assert np.ptp(run.angular_momentum, axis=0).max() < 1e-8 * np.abs(run.angular_momentum).max()
    weight = 9.8 * (springs.parameters["torso_mass"] + springs.parameters["tail_mass"])
    fallen = run.linear_momentum + np.outer(run.t, [0, 0, weight])
    assert np.ptp(fallen, axis=0).max() < 1e-8 * weight
    stiff = st.simulate(springs, q, v, t_span=0.05, method="ros34pw2", rtol=1e-7)
    there = st.simulate(springs, q, v, t_span=0.05, method="tsit5", rtol=1e-10)
    assert np.abs(stiff.q[-1] - there.q[-1]).max() < 1e-4


def test_arcs_are_guarded_and_links_are_not():
    model = model_of(LINKS, ARC, bend_range=3.0)
    q, v = np.zeros(11), np.zeros(10)
    q[3], q[7] = 1, 20.0
    model.forward_dynamics(q, v, np.zeros(4))
    q[9] = 3.1
    with pytest.raises(st.StateError):
        model.forward_dynamics(q, v, np.zeros(4))


# ---- what a model says ---------------------------------------------------------------------------


def test_models_tell_their_kinds():
    model = model_of(*BOTH, samples=3)
    assert model.kind == "mixed"
    assert model.kinds == ("continuum", "articulated", "continuum", "articulated")
    assert model.links == (0, 2, 0, 3)
    assert model.samples == 3
    assert "an arc, 2 links, an arc, 3 links" in repr(model)
    assert model.parameters["tail_mass"] == pytest.approx(1.5e-3 + 9e-4 + 1.1e-3 + 1.5e-3)
    assert model.parameters["tail_length"] == pytest.approx(0.06 + 0.055 + 0.09 + 0.06)
    radii = np.array(shape(model)["tail_radii"])
    assert len(radii) == 3 + 2 + 3 + 3
    arcs = np.sqrt(np.array([1.5e-3 / 0.06, 1.1e-3 / 0.09]) / 1e3 / np.pi)
    np.testing.assert_allclose(radii[:3], arcs[0])
    np.testing.assert_allclose(radii[5:8], arcs[1])
    np.testing.assert_allclose(radii[3], np.sqrt(2 * 2e-9 / 5e-4))
    other = model.with_parameters(arc_masses=[1e-3, 2e-3], link_masses=[1e-4] * 5)
    assert other.parameters["tail_mass"] == pytest.approx(3.5e-3)


def test_motions_of_both_kinds_are_labelled_and_warned_of():
    functions = ["energy", "momentum", "rollout", "tail_points"]
    model = model_of(LINKS, ARC, functions=functions)
    q, v = np.zeros(11), np.zeros(10)
    q[3], q[7], q[9], q[10] = 1, 1.2, 2.5, 2.5
    run = st.simulate(model, q, v, t_span=0.01)
    names = contents(run).labels["joint"]
    assert names == ["alpha_1", "beta_1", "a_2", "b_2"]
    told = [each for each in run.warnings if "is bent by" in each]
    assert ["segment 1 is bent by 3.6" in told[0], "segment 2 is bent by 3.5" in told[1]] == [
        True
    ] * 2


def test_models_are_built_by_options():
    model = st.build(tail="mixed", segments=[LINKS, ARC], functions=NAMES, arc_masses=[0.002])
    assert model.parameters["arc_masses"] == (0.002,)
    assert model.kinds == ("articulated", "continuum")


@pytest.mark.parametrize("kind", ["urdf", "mjcf"])
def test_other_formats_have_no_arcs(kind, tmp_path):
    with pytest.raises(st.ExportError, match="needs an articulated tail"):
        st.export(
            model_of(LINKS, ARC), kind, tmp_path / f"both.{'xml' if kind == 'mjcf' else kind}"
        )


@pytest.mark.slow
def test_plans_bend_both_kinds():
    """A turn by half a radian of yaw, from rest to rest."""
    model = st.build(tail="mixed", segments=[LINKS, ARC])
    q, half = np.zeros(11), 0.25
    q[3] = 1
    goal = st.Goal(attitude=(np.cos(half), 0, 0, np.sin(half)))
    plan = st.plan(model, start=(q, np.zeros(10)), goal=goal, duration=0.5)
    assert plan.success
    assert np.abs(plan.trajectory.tail).max(axis=0)[[1, 3]].min() > 1e-3


def test_units_of_other_simulators_have_both_kinds(tmp_path):
    functions = [
        "forward_dynamics",
        "forward_dynamics_derivatives",
        "rollout",
        "energy",
        "momentum",
    ]
    path = st.export(model_of(LINKS, ARC, functions=functions), "fmu", tmp_path / "both.fmu")
    with zipfile.ZipFile(path) as unit:
        text = unit.read("modelDescription.xml").decode()
    assert "torque on beta_1" in text
    assert "torque on a_2" in text


@pytest.mark.slow
def test_every_law_holds():
    from serpentail.verification.report import laws

    model = model_of(LINKS, ARC, functions="all", parameters=ALL | {"mount_angles": TILT})
    assert [check.name for check in laws(model) if not check.passed] == []


# ---- code ----------------------------------------------------------------------------------------

COUNTED = Shape((3, 3, 5), ("articulated", "articulated", "continuum"), 6, 1)


def test_runs_number_the_pieces_of_their_kind():
    shape = Shape((2, 5, 5, 3), ("articulated", "continuum", "continuum", "articulated"), 5, 2)
    tail = Tail(4, 5, "mixed", shape=shape)
    assert tail.runs("articulated") == (Run(0, 1, 0, 2), Run(3, 4, 4, 7, 2, 10, 2))
    assert tail.runs("continuum") == (Run(1, 3, 2, 4, 2, 2, 1),)
    assert tail.pieces == 7
    assert tail.total == 15


def test_steps_are_those_of_a_stretch():
    draft = Draft("x", "", tail=Tail(3, 5, "mixed", shape=COUNTED))
    kinds = [mechanism(draft).pose.__module__.rpartition(".")[2] for _ in each_segment(draft)]
    assert kinds == ["link", "arc"]
    with pytest.raises(ValueError, match="within loops over its segments"):
        mechanism(draft).pose()


@pytest.mark.parametrize("name", ["mass_matrix", "bias_force", "forward_dynamics"])
def test_a_mixed_tail_costs_no_more_than_both_kinds(name):
    """Two segments of three links and an arc; links alone cost about as much."""
    counts = [
        straight_line(assemble(FUNCTIONS[name], tail), "double", "x").operations
        for tail in (
            Tail(3, 3, shape=Shape(links=9)),
            Tail(3, 5, "mixed", shape=COUNTED),
            Tail(3, 5, "continuum", shape=Shape(arcs=3)),
        )
    ]
    assert 0.9 * counts[0] < counts[1] < counts[2], counts


# ---- parameters ---------------------------------------------------------------------------------


def test_parameters_of_a_wrong_length_are_refused():
    model = model_of(LINKS, ARC)
    with pytest.raises(st.ModelError, match=r"arc_masses: value \[0\.1, 0\.2\]: needs"):
        model.with_parameters(arc_masses=[0.1, 0.2])
    with pytest.raises(st.ModelError, match="link_lengths"):
        model.with_parameters(link_lengths=[0.1] * 4)

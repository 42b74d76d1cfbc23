"""What a page holds: numbers, words on what is not shown, and how thick torso and tail are."""

import dataclasses
import pickle

import numpy as np
import pytest

import serpentail as st
from serpentail.show.animal import animal_of, poses_of
from serpentail.show.live.live import instances
from serpentail.show.page.samples import packed
from tests.motion.conftest import at_height, scene_of, told
from tests.support import page, zoo
from tests.support.page import data_of
from tests.support.rows import row

from .conftest import flown, plan

WEIGHT = 9.8 * (0.10572 + 0.00351)
RADIUS = 0.0029  # m: the rat's usual one


def single_run(path):
    data = data_of(path)
    (run,) = data["runs"]
    return data, run


def test_what_float32_cannot_hold_is_packed_as_its_largest():
    largest = float(np.finfo(np.float32).max)
    found = page._floats(packed(np.array([1e300, -1e300, -0.0, 1e-44])), 4)
    assert found.ravel().tolist() == [largest, -largest, -0.0, float(np.float32(1e-44))]


def test_the_kick_is_whole_and_below_1_mb(tmp_path, kick):
    path = kick.view(tmp_path / "run.html")
    data, run = single_run(path)
    numbers, summary = dict(run["numbers"]), told(kick)
    assert numbers["samples"] == "1201" and numbers["landed, and stands at the end"] == "no"
    said = "largest force of the ground"
    for label, name in (
        *(("take-off (s)", "take_off_s"), ("highest torso (m)", "apex_m")),
        *((f"{said} (N)", "peak_ground_force_N"), ("tilt at the end (deg)", "tilt_end_deg")),
        (f"{said} (body weights)", "peak_ground_force_weights"),
    ):
        assert float(numbers[label]) == pytest.approx(summary[name], rel=1e-3), label
    assert data["notes"] == [] and data["warnings"] == kick.warnings and len(kick.warnings) == 5
    assert [event["time"] for event in run["events"]] == [event["time"] for event in kick.events]
    assert run["events"][0]["label"] == "feet take off"
    forces = np.linalg.norm(kick.contact.forces, axis=2)
    assert data["force_scale"] == pytest.approx(np.percentile(forces[forces > 0], 95))
    shown = [plot["curves"][0]["array"] for plot in data["plots"]]
    assert shown == ["height", "tilt", "bends", "torque", "force", "momentum", "energy"]
    assert [plot["compressed"] for plot in data["plots"]] == pytest.approx([0] * 4 + [WEIGHT, 0, 0])
    assert [plot["least"] for plot in data["plots"]] == [1e-3, 0.1, 0.1, 0, 0, 1e-9, 0]
    loaded = st.Trajectory.load(kick.save(tmp_path / "kick.npz"))
    again = loaded.view(tmp_path / "loaded.html", model=kick.model)
    assert again.read_bytes() == path.read_bytes()
    assert path == tmp_path / "run.html" and path.stat().st_size <= 1e6

    # times, poses and points are the motion's
    arrays, model = run["arrays"], kick.model
    legs = st.leg_joints(model, kick, scene_of("kick").legs.curve.at(kick.t)[0])
    pushed = np.linalg.norm(kick.contact.forces, axis=2) > 0
    expected = {
        "pose": kick.q[:, :7],
        "tail": model.tail_points(kick.q),
        "com": model.center_of_mass(kick.q, kick.v)[0],
        "legs": legs,
        "forces": kick.contact.forces,
        "touching": kick.contact.points * pushed[..., None],
        "bends": np.degrees(3 * kick.tail),  # of three links
        "energy": np.stack([kick.energy, kick.kinetic, kick.potential], axis=1),
        "force": np.linalg.norm(kick.contact.forces.sum(axis=1), axis=1),
        "height": kick.q[:, 2],
        "torque": kick.tau,
        "momentum": kick.angular_momentum,
    }
    for name, array in expected.items():
        flat = np.asarray(array).reshape(1201, -1).astype(np.float32)
        np.testing.assert_array_equal(arrays[name], flat, err_msg=name)
    np.testing.assert_allclose(arrays["t"].astype(float).sum(axis=1), kick.t, rtol=0, atol=1e-12)

    # the leg's last three joints are the foot's points
    feet = arrays["legs"].reshape(1201, 2, 6, 3)[:, :, 3:].reshape(1201, 6, 3)
    np.testing.assert_allclose(feet, kick.contact.points, atol=1e-7)


def test_a_flight_has_ground_if_it_stays_above_it_and_no_legs(tmp_path, flight):
    low = dataclasses.replace(flight, q=flight.q - 0.3 * np.eye(1, flight.q.shape[1], 2))
    data, run = single_run(low.view(tmp_path / "run.html"))
    assert (run["grounded"], run["legs"], run["contacts"]) == (False, 0, 0)
    data, run = single_run(flight.view(tmp_path / "run.html"))
    assert run["grounded"] and (run["bases"], run["tip"]) == ([0, 5], 10)
    assert not {"legs", "forces", "touching", "force"} & set(run["arrays"])
    assert not run["body"]["jointed"]
    assert not any("force" in plot["title"] for plot in data["plots"])
    assert not data["notes"] and not any("force" in label for label, _ in run["numbers"])
    assert data["force_scale"] == pytest.approx(WEIGHT)
    # the torso is the ellipsoid of its inertia
    parameters = flight.model.parameters
    squares = np.array(run["body"]["semi_axes"]) ** 2
    inertia = parameters["torso_mass"] / 5 * (squares.sum() - squares)
    np.testing.assert_allclose(inertia, parameters["torso_inertia"], rtol=1e-12)
    assert data["length"] == pytest.approx(parameters["tail_length"] + 2 * squares[1] ** 0.5)
    assert run["points"] == flight.model.tail_points(flight.q).shape[1]
    for name, tail in ("tree", [0, 3]), ("limbs", [0]):  # curves of chains by their names
        tree = zoo.model(name)
        run = st.simulate(tree, tree.state(height=1), 0.01)
        data, found = single_run(run.view(tmp_path / "run.html"))
        curves = [each["label"] for plot in data["plots"][2:4] for each in plot["curves"]]
        assert curves == [*tree.names.tail] * 2 and found["bases"] == tail
    single = flight.resample([0.0]).view(tmp_path / "run.html")
    assert single_run(single)[1]["rows"] == 1


def test_many_samples_are_thinned_and_the_page_says_so(tmp_path, flight):
    t = 1e4 + 1e-3 * np.arange(100_001)
    long = dataclasses.replace(flight.resample(np.linspace(0, 0.2, len(t))), t=t)
    data, run = single_run(long.view(tmp_path / "run.html"))
    (note,) = data["notes"]
    assert "one of 42 samples" in note and "100001" in note
    times = run["arrays"]["t"].astype(float).sum(axis=1)
    assert run["rows"] == len(times) <= 2400
    np.testing.assert_allclose(times[[0, 1, -1]], t[[0, 42, -1]], 1e-13)
    assert dict(run["numbers"])["samples"] == "100001"


def test_several_motions_have_names_that_stay_data(tmp_path, kick, flight):
    """No name ends the script that the data are in, opens a tag, or takes part in the template."""
    path = tmp_path / "page.html"
    plain = st.view([kick, flight], path).read_text().count("<")
    data = data_of(path)
    assert [run["name"] for run in data["runs"]] == ["run 1", "run 2"]
    assert {curve["run"] for curve in data["plots"][0]["curves"]} == {0, 1}
    assert all(each.startswith("run 1: ") for each in data["warnings"])
    names = ["</script><b>&\"'\\", "/*DATA*/<!--TITLE-->"]
    data = data_of(st.view([kick, flight], path, names=names))
    assert [run["name"] for run in data["runs"]] == names
    assert path.read_text().count("<") == plain


def test_rollouts_show_runs_and_where_they_failed(tmp_path):
    model, path = zoo.model("m1_n3"), tmp_path / "runs.html"
    q0, v0 = np.zeros((3, model.nq)), np.zeros((3, model.nv))
    q0[:, 3], v0[1, 6:] = 1, 1e9
    runs = st.simulate(model, q0, v0, t_span=0.1, method="tsit5", most_steps=2000)
    assert runs.errors[1] is not None and runs.errors[2] is None
    data = data_of(runs.view([0, 1], path))
    assert [run["name"] for run in data["runs"]] == ["run 0", "run 1"]
    assert len(data["notes"]) == 1 and str(runs.errors[1]) in data["notes"][0]
    assert data_of(runs.view(2, path))["runs"][0]["rows"] == len(runs.t)
    for wrong in (3, -1, [0, 3], "ab", None, 1.5):
        with pytest.raises(st.ViewError, match=r"k: value .* 0 to 2"):
            runs.view(wrong, path)


def test_a_plan_shows_what_it_plans_and_what_is_true(tmp_path):
    data = data_of(plan().view(tmp_path / "plan.html"))
    assert [run["name"] for run in data["runs"]] == ["planned", "true", "passive"]
    times = [run["arrays"]["t"].astype(float).sum(axis=1) for run in data["runs"]]
    np.testing.assert_allclose(times, [plan().trajectory.t] * 3, rtol=0, atol=1e-9)
    ends = [run["arrays"]["bends"][-1, 0] for run in data["runs"]]
    assert abs(ends[0]) < 1e-3 and abs(ends[1]) < 1
    assert ends[2] == pytest.approx(3 * np.degrees(0.4))  # at rest, with no torque

    copy = dataclasses.replace(plan(), trajectory=pickle.loads(pickle.dumps(plan().trajectory)))
    with pytest.raises(st.ViewError, match="give model"):
        copy.view(tmp_path / "other.html")
    other = copy.view(tmp_path / "other.html", model=zoo.model("m1_n3"))
    assert other.read_bytes() == (tmp_path / "plan.html").read_bytes()


def test_links_and_arcs_are_drawn_as_thick_as_they_are():
    """Arcs as that mass of water; the last link has no inertia along itself."""
    for name in ("own_links", "mixed"):
        model, changes = zoo.model(name), {}
        p = model.parameters
        links = np.linspace(0.004, 0.001, len(p.get("link_masses", ())))
        arcs = np.linspace(0.003, 0.002, len(p.get("arc_masses", ())))
        if links.size:
            masses = np.linspace(2e-3, 1e-3, len(links))
            along = masses * links**2 / 2
            along[-1], links[-1] = 0, 0.015 * p["tail_length"]
            inertias = np.stack([2e-8 + 0 * along, along, 2e-8 + 0 * along], axis=1)
            changes = {"link_masses": masses, "link_inertias": inertias}
        if arcs.size:
            changes["arc_masses"] = 1e3 * np.pi * arcs**2 * np.array(p["arc_lengths"])
        model, arcs = model.with_parameters(**changes), np.repeat(arcs, model.samples or 1)
        radii = np.concatenate([links, arcs])
        if name == "mixed":  # an arc, two links, an arc, three links
            radii = np.concatenate([arcs[:3], links[:2], arcs[3:], links[2:]])
        q = at_height(model, 0.0, 2)
        animal = animal_of(model)
        scales = instances(animal, poses_of(model, q, None))["tail"].scales
        with row(name):
            np.testing.assert_allclose(animal.tail_radii, radii)
            assert not animal.alike
            np.testing.assert_allclose(scales[: len(radii), 0], radii)
            np.testing.assert_allclose(scales[len(radii) :, 1], radii)


def test_equal_links_have_one_thickness_and_thin_torsos_boxes_and_fixed_bases_are_seen(tmp_path):
    model = zoo.model("m2_n2")
    animal = animal_of(model)
    np.testing.assert_allclose(animal.tail_radii, RADIUS * (1.15 - 0.5 * np.arange(4) / 5))
    assert animal.alike and animal.jointed and not animal_of(zoo.model("arcs2")).jointed
    flat = model.with_parameters(torso_inertia=(8e-5, 8e-5, 1.6e-4))  # a disc
    least, most, _ = np.sort(animal_of(flat).semi_axes)
    assert least == 0.15 * most
    # a robot is the box of its scene, without a head
    robot = flown(st.build("tailed_robot"), 3).view(tmp_path / "robot.html")
    body = single_run(robot)[1]["body"]
    assert body["semi_axes"] == pytest.approx([0.04, 0.06, 0.015])
    assert body["box"] and not body["head"]
    # a fixed base is a ball at the mount
    model = zoo.model("fixed")
    reach = np.linalg.norm(model.parameters["tail_mount"])
    assert animal_of(model).semi_axes == (max(reach, 2 * RADIUS),) * 3
    assert not animal_of(model).head
    model = model.with_parameters(tail_mount=(0, 0, 0))
    assert animal_of(model).semi_axes == (2 * RADIUS,) * 3

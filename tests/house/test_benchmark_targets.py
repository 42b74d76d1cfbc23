"""The benchmark's targets: a report of known figures is judged as a reader of it would."""

from benchmarks.targets import TARGETS, judged

TIMES = {"plain_ns": 1400.0, "tuned_ns": 1300.0, "mujoco_ns": 1099.0, "casadi_ns": 126.0}
REPORT = {
    "speed": [{"model": "(1, 3)", "ns": 100.0} | TIMES, {"model": "(8, 16)", "ns": 100.0} | TIMES],
    "other_peers": [
        {"model": "(1, 3)", "ns": 100.0} | TIMES,
        {"model": "(6, 6)", "ns": 99.0, "casadi_ns": ""} | TIMES,
    ],
    "continuum_peer": [{"left out": "not installed"}],
    "jacobian_times": [{"model": "(1, 3)", "ns": 100.0} | TIMES],
    "batch_times": [{"model": "(1, 3)", "one by one, ns": 61.0, "side by side, ns": 10.0}],
}


def test_a_target_is_met_from_its_ratio_on_in_the_rows_that_it_names():
    found = [
        (row["slower"].split(":")[1].strip(), row["model"], row["verdict"])
        for row in judged(REPORT)
    ]
    assert found == [
        ("Pinocchio, coupled, as documented", "(1, 3)", "met"),
        ("Pinocchio, coupled, as documented", "(8, 16)", "MISSED"),
        ("Pinocchio, coupled, tuned", "(1, 3)", "met"),
        ("Pinocchio, coupled, tuned", "(8, 16)", "MISSED"),
        ("MuJoCo, reduced", "(1, 3)", "MISSED"),
        ("MuJoCo, reduced", "(6, 6)", "met"),
        ("CasADi's C", "(1, 3)", "met"),
        ("Pinocchio, as documented", "(1, 3)", "met"),
        ("Pinocchio, tuned", "(1, 3)", "MISSED"),
        ("one by one", "(1, 3)", "met"),
    ]


def test_every_target_names_a_measure():
    from benchmarks import measures  # with every peer: seconds for each worker, were it above

    assert {target.measure for target in TARGETS} <= measures.MEASURES.keys()

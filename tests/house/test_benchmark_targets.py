"""The benchmark's targets: a report of known figures is judged as a reader of it would."""

from benchmarks.targets import TARGETS, judged

TIMES = {"plain_ns": 1400.0, "tuned_ns": 1300.0, "mujoco_ns": 1099.0, "casadi_ns": 126.0}
BATCH = {"model": "(1, 3)", "side by side, ns": 10.0, "function": "forward_dynamics_derivatives"}
REPORT = {
    "speed": [{"model": "(1, 3)", "ns": 100.0} | TIMES, {"model": "(8, 16)", "ns": 100.0} | TIMES],
    "other_peers": [
        {"model": "(1, 3)", "ns": 100.0} | TIMES,
        {"model": "(6, 6)", "ns": 99.0, "mujoco_ns": 1099.0},
    ],
    "continuum_peer": [{"left out": "not installed"}],
    "jacobian_times": [{"model": "(1, 3)", "ns": 100.0, "revolutes_ns": 1300.0} | TIMES],
    "batch_times": [
        BATCH | {"processor": processor, "one by one, ns": 25.0}
        for processor in ("AVX-512", "AVX2")
    ],
    "flight_times": [
        {"scene": "(1, 3), flight of 0.03 s", "overhead_us": 60.5},
        {"scene": "(3, 4), impact", "real_time_factor": 150.0},
    ],
    "operation_counts": [BATCH | {"executed": 1.2, "needed": 1.0}],
}


def test_a_target_is_met_from_its_bound_on_in_the_rows_that_it_names():
    found = [
        (row["target"].split(":")[-1].strip(), row["model"], row["processor"], row["verdict"])
        for row in judged(REPORT)
    ]
    batch, share = "Jacobians, batch over one by one", "operations executed over needed, Jacobians"
    assert found == [
        ("Pinocchio, coupled, as documented", "(1, 3)", "any", "met"),
        ("Pinocchio, coupled, as documented", "(8, 16)", "any", "MISSED"),
        ("Pinocchio, coupled, tuned", "(1, 3)", "any", "met"),
        ("Pinocchio, coupled, tuned", "(8, 16)", "any", "MISSED"),
        ("MuJoCo, reduced", "(1, 3)", "any", "MISSED"),
        ("MuJoCo, reduced", "(6, 6)", "any", "met"),
        ("CasADi's C", "(1, 3)", "any", "met"),
        ("Pinocchio, as documented", "(1, 3)", "any", "met"),
        ("Pinocchio, tuned", "(1, 3)", "any", "MISSED"),
        (batch, "(1, 3)", "AVX-512", "MISSED"),  # 3 times with eight lanes
        (batch, "(1, 3)", "AVX2", "met"),  # twice with four
        (f"{share}, batch", "(1, 3)", "any", "met"),
        ("(1, 3), flight of 0.03 s", "", "any", "MISSED"),
        ("(3, 4), impact", "", "any", "met"),
    ]


def test_every_target_names_a_measure():
    from benchmarks import measures  # with every peer: seconds for each worker, were it above

    assert {target.measure for target in TARGETS} <= measures.MEASURES.keys()

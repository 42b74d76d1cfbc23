"""What is told of things and of long work: reprs of six lines for a REPL; progress for a function,
the log, a terminal and a pipe, and for nobody by default.
"""

import dataclasses
import io
import logging
import re

import numpy as np
import pytest

import serpentail as st
from serpentail.basics.progress import ProgressWriter, Stage
from tests.support import zoo
from tests.support.rows import row

MOST_LINES, MOST_CHARACTERS = 6, 600  # a terminal of 100 columns wraps what is one line


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def clock(monkeypatch):
    """Return a function that lets time pass."""
    now = [100.0]
    monkeypatch.setattr("time.perf_counter", lambda: now[0])
    return lambda seconds: now.__setitem__(0, now[0] + seconds)


def enough(now):
    raise ZeroDivisionError(now.stage)


def told_of(work):
    """What a function is told of some work."""
    told = []
    with st.progress(told.append):
        work()
    return told


TUMBLE = np.eye(9)[3], 9 * np.eye(8)[3]  # q, v


def test_a_function_is_told_each_stage_and_ends_the_work_by_what_it_raises(tmp_path, monkeypatch):
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path))
    # made anew, because its making is what is told
    tiny = {"tail": "articulated", "segments": 1, "links": 1, "functions": ["energy", "momentum"]}
    with pytest.raises(ZeroDivisionError), st.progress(enough):
        st.build(**tiny)
    told = told_of(lambda: st.build(**tiny))  # nothing is left in the way
    ends = [now for now in told if now.ended]
    assert [now.stage for now in ends] == ["derive", "compile"]
    assert ends[0].what == "articulated_m1_n1" and ends[0].left == 0
    parts = [now.done for now in told if now.stage == "derive" and now.done is not None]
    assert parts == sorted(parts) and all(0 <= part < 1 for part in parts)
    assert told_of(lambda: st.build(**tiny)) == []


def test_a_pipe_has_few_lines_and_a_terminal_one_that_ends_empty(clock):
    """Of a stage of half a second, and one of a minute."""
    assert st.Progress("plan", "", None, 10.0).left is None
    texts = []
    for stream in (io.StringIO(), Terminal()):
        with st.progress(ProgressWriter(stream)):
            with Stage("compile", "short") as stage:
                clock(0.5)
                stage.tell(0.5)
            with Stage("derive", "long") as stage:
                for part in range(60):
                    clock(1)
                    stage.tell(part / 60)
        texts.append(stream.getvalue())
    lines, text = texts[0].splitlines(), texts[1]
    assert lines[0] == "derive long: 1 s so far" and lines[-1] == "derive long: 60.0 s"
    assert len(lines) == 2 + 5 and lines[1] == "derive long: 17%, 11 s, 55 s left"
    assert "\n" not in text and "short" not in text and text.count("derive long") == 60
    assert text.rsplit("\r", 2)[1].isspace() and text.endswith("\r")

    # a part of another stage is told to functions alone
    stream, told = io.StringIO(), []
    for hook in (ProgressWriter(stream), told.append):
        with st.progress(hook), Stage("plan", "all") as outer:
            clock(2)
            outer.tell()
            with Stage("simulate", "part") as inner:
                clock(20)
                inner.tell()
    assert "simulate" not in stream.getvalue() and stream.getvalue().count("plan all") == 2
    assert [now.depth for now in told] == [0, 1, 1, 0]


def test_nobody_is_told_by_default_and_the_log_of_the_ends(clock, caplog, capsys):
    with caplog.at_level(logging.DEBUG, "serpentail"):
        with Stage("compile", "rat.c") as stage:
            clock(60)
            stage.tell(0.5)
        with pytest.raises(KeyError), Stage("derive", "rat"):
            raise KeyError
    assert caplog.messages == ["compile rat.c: 60.0 s", "derive rat: 0.0 s, ended by KeyError"]
    assert capsys.readouterr() == ("", "")


def test_short_work_is_told_to_those_who_debug(clock, caplog):
    for seconds, level in ((0.4, logging.DEBUG), (0.6, logging.INFO)):
        caplog.clear()
        with caplog.at_level(logging.DEBUG, "serpentail"), Stage("simulate", "rat"):
            clock(seconds)
        assert [record.levelno for record in caplog.records] == [level]


def test_runs_and_a_long_run_are_told_by_the_part_that_is_done():
    rat, (q, v) = zoo.model("m1_n1"), TUMBLE
    many = {"q0": np.tile(q, (400, 1)), "v0": v, "t_span": 0.2, "method": "rk4"}
    long = {"q0": q, "v0": v, "t_span": 300, "method": "rk4", "output_step": 1.0, "step": 1e-3}
    for settings in (many | {"threads": 1}, many | {"threads": 2}, long):
        told = told_of(lambda settings=settings: st.simulate(rat, **settings))
        parts = [now.done for now in told if now.stage == "simulate"]
        assert parts == sorted(parts) and parts[-1] == 1.0 and told[-1].ended
        assert "400 runs" in told[0].what or (len(told) > 2 and parts[0] < 1)


def test_what_the_function_raises_ends_long_work():
    rat, (q, v) = zoo.model("m1_n3"), TUMBLE
    for stage, work in [
        ("simulate", lambda: st.simulate(rat, q, v, t_span=500)),
        ("simulate", lambda: st.simulate(rat, np.tile(q, (3, 1)), v, t_span=500)),
        ("plan", lambda: st.plan(rat, start=TUMBLE, duration=0.3)),
    ]:
        with pytest.raises(ZeroDivisionError, match=stage), st.progress(enough):
            work()


def test_a_plan_tells_its_rounds():
    settings = {"duration": 0.3, "mesh": st.Mesh(intervals=6, rounds=2), "start": TUMBLE}
    settings["solver"] = st.Solver(track=False)
    told = []
    with st.progress(told.append):
        plan = st.plan(zoo.model("m1_n3"), goal=st.Goal(attitude=None), **settings)
    plans = [now for now in told if now.stage == "plan"]
    rounds = {now.what for now in plans if "after round" in now.what}
    assert len(rounds) == plan.report["rounds"] and plans[-1].ended
    assert len(plans) > plan.report["iterations"]


# Reprs.


def flown(runs=None, **settings):
    """Drops of a rat from 0.3 m, or of many."""
    q = np.array([0, 0, 0.3, 1, 0, 0, 0, 0.1, 0])
    q = q if runs is None else np.tile(q, (runs, 1))
    settings = {"legs": st.Legs.fixed(3.6, -0.3), "t_span": 0.05, "rtol": 1e-6} | settings
    return st.simulate(zoo.model("feet"), q, np.zeros(8), **settings)


def tired(t, q, v):
    """A controller that gives up at 0.02 s, above 0.29 m."""
    if 0.02 < t < 0.022 and q[2] > 0.29:
        raise st.SimulationError("it is tired")
    return np.zeros(2)


def test_what_the_package_gives_fills_no_screen_and_says_what_it_is_and_how_it_ended(tmp_path):
    rat, motion, runs = zoo.model("feet"), flown(output_step=0.001), flown(300)
    still = np.array([0, 0, 0, 1, 0.1, 0, 0, 0, 0]), np.zeros(8)
    settings = {"goal": st.Goal(attitude=None, torso_rate=None), "solver": st.Solver(track=False)}
    settings |= {"tolerances": st.Tolerances(attitude=None), "mesh": st.Mesh(intervals=4)}
    settings["duration"] = 0.1
    plan = st.plan(zoo.model("m1_n3"), start=still, **settings)
    times = np.linspace(0, 1, 500)
    table = st.TorqueTable(times, np.zeros((500, 2)))
    reference = st.Reference(times, np.zeros((500, 2)))
    legs = st.Legs(times, 3 + 0 * times, -0.3 + 0 * times)
    scenario = st.Scenario(rat, motion.q[0], motion.v[0], 1.0, table, legs, {"rtol": 1e-6})
    phases = st.Phases([(0.0, table), (0.5, table), (0.7, None)])
    things = [motion, motion.contact, runs, runs.audit, plan, table, reference, legs, scenario]
    things += [plan.trajectory, plan.problem, plan.curve, plan.mesh, plan.rule, plan.solution]
    things += [rat, rat.casadi, reference.curve, st.Damping(), st.Goal(), st.Bounds(), phases]
    for thing in [*things, st.Pfl(rat, reference)]:
        with row(type(thing).__name__):
            text = repr(thing)
            assert text.count("\n") < MOST_LINES and len(text) <= MOST_CHARACTERS
            assert max(map(len, text.splitlines())) <= 100 or "\n" not in text
    with pytest.raises(st.SimulationError) as caught:
        flown(controller=tired)
    failed = flown(3, parameters={"gravity": [90.0, 90.0, 9.8]}, controller=tired)
    warned = dataclasses.replace(motion, info=motion.info | {"warnings": ["word " * 99, "b"]})
    report = plan.report | {"status": "Infeasible", "effort": None}
    tails = "1 x 3 links.*51 samples, 0 to 0.05 s.*by points: 6 of the feet; 0 events"
    for thing, words in [
        (motion, rf"{tails}.*\n  by switching: .*steps"),
        (motion.contact, "forces=array of 51 x 6 x 3"),
        (st.Trajectory.load(motion.save(tmp_path / "run.npz")), "without its model"),
        (warned, r"\n(?=.{9,100}$)[^\n]*run: 2, the first: word word[^\n]*\.\.\.>$"),
        (caught.value.trajectory, "failed: it is tired"),
        (failed, "3 runs of 21 samples, 0 to 0.05 s.*1 failed, the first run 2: it is tired"),
        (plan, f": success\n.*{plan.mesh.intervals} intervals"),
        (dataclasses.replace(plan, success=False, report=report), r"no success \(Infeasible\)"),
        (rat.casadi, "^<CasadiFunctions of feet, SX and compiled:\n  "),
        (st.Legs([0.0], 3.5, -0.25), r"^Legs\(times=\[0.0\], gamma=3.5, delta=-0.25,"),
    ]:
        with row(words):
            assert re.search(words, repr(thing), re.DOTALL)

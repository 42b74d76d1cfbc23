"""Long work tells how far it is: a function, the log, a terminal, a pipe, and nobody by default."""

import io
import logging

import numpy as np
import pytest

import serpentail as st
from serpentail.stages import Stage, Told
from tests.support import zoo


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self):
        return True


@pytest.fixture
def clock(monkeypatch):
    """Return a function that lets time pass."""
    now = [100.0]
    monkeypatch.setattr("time.perf_counter", lambda: now[0])
    return lambda seconds: now.__setitem__(0, now[0] + seconds)


def test_a_function_is_told_each_stage_and_ends_the_work_by_what_it_raises(tmp_path, monkeypatch):
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path))
    # made anew, because its making is what is told
    tiny = {"tail": "articulated", "segments": 1, "links": 1, "functions": ["energy", "momentum"]}
    with pytest.raises(ZeroDivisionError), st.progress(enough):
        st.build(**tiny)
    told = []
    with st.progress(told.append):
        st.build(**tiny)  # nothing is left in the way
    ends = [now for now in told if now.ended]
    assert [now.stage for now in ends] == ["derive", "compile"]
    assert ends[0].what == "articulated_m1_n1" and ends[0].left == 0
    parts = [now.done for now in told if now.stage == "derive" and now.done is not None]
    assert parts == sorted(parts) and all(0 <= part < 1 for part in parts)
    count = len(told)
    st.build(**tiny)
    assert len(told) == count


def enough(now):
    """End the work."""
    raise ZeroDivisionError(now.stage)


def test_the_estimate_is_of_what_is_left():
    assert st.Progress("plan", "", 0.25, 10.0).left == 30.0
    assert st.Progress("plan", "", None, 10.0).left is None
    assert str(st.Progress("plan", "rat", 0.25, 10.0)) == "plan rat: 25%, 10 s, 30 s left"
    assert str(st.Progress("plan", "rat", 0.25, 10.0, ended=True)) == "plan rat: 10.0 s"


def test_a_pipe_has_few_lines_and_a_terminal_one_that_ends_empty(clock):
    """Of a stage of half a second, and one of a minute."""
    texts = []
    for stream in (io.StringIO(), Terminal()):
        with st.progress(Told(stream)):
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


def test_a_part_of_another_stage_is_told_to_functions_alone(clock):
    stream, told = io.StringIO(), []
    for hook in (Told(stream), told.append):
        with st.progress(hook), Stage("plan", "all") as outer:
            clock(2)
            outer.tell()
            with Stage("simulate", "part") as inner:
                clock(20)
                inner.tell()
    assert "simulate" not in stream.getvalue() and stream.getvalue().count("plan all") == 2
    assert [now.depth for now in told] == [0, 1, 1, 0]


def test_nobody_is_told_by_default_and_the_log_of_the_ends(clock, caplog, capsys):
    with caplog.at_level(logging.INFO, "serpentail"):
        with Stage("compile", "rat.c") as stage:
            clock(60)
            stage.tell(0.5)
        with pytest.raises(KeyError), Stage("derive", "rat"):
            raise KeyError
    assert caplog.messages == ["compile rat.c: 60.0 s", "derive rat: 0.0 s, ended by KeyError"]
    assert capsys.readouterr() == ("", "")


def start(model):
    """A tumble: q, v."""
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[3], v[3] = 1, 9
    return q, v


def told_of(stage, work):
    """What a function is told of a stage of some work, by the part that is done."""
    told = []
    with st.progress(told.append):
        work()
    told = [now for now in told if now.stage == stage]
    parts = [now.done for now in told]
    assert parts == sorted(parts) and parts[-1] == 1.0 and told[-1].ended
    return told


def test_runs_and_a_long_run_are_told_by_the_part_that_is_done():
    rat = zoo.model("m1_n1")
    q, v = start(rat)
    many = {"q0": np.tile(q, (400, 1)), "v0": v, "t_span": 0.2, "method": "rk4"}
    for threads in (1, 2):
        told = told_of("simulate", lambda t=threads: st.simulate(rat, threads=t, **many))
        assert "400 runs" in told[0].what
    long = {"t_span": 300, "method": "rk4", "output_step": 1.0, "step": 1e-3}
    told = told_of("simulate", lambda: st.simulate(rat, q, v, **long))
    assert len(told) > 2 and told[0].done < 1


def test_what_the_function_raises_ends_long_work():
    rat = zoo.model("m1_n3")
    q, v = start(rat)
    for stage, work in [
        ("simulate", lambda: st.simulate(rat, q, v, t_span=500)),
        ("simulate", lambda: st.simulate(rat, np.tile(q, (3, 1)), v, t_span=500)),
        ("plan", lambda: st.plan(rat, start=(q, v), duration=0.3)),
    ]:
        with pytest.raises(ZeroDivisionError, match=stage), st.progress(enough):
            work()


def test_a_plan_tells_its_rounds():
    rat, told = zoo.model("m1_n3"), []
    settings = {"duration": 0.3, "intervals": 6, "rounds": 2, "track": False}
    with st.progress(told.append):
        plan = st.plan(rat, start=start(rat), goal=st.Goal(attitude=None), **settings)
    plans = [now for now in told if now.stage == "plan"]
    rounds = {now.what for now in plans if "after round" in now.what}
    assert len(rounds) == plan.report["rounds"] and plans[-1].ended
    assert len(plans) > plan.report["iterations"]

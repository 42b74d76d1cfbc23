"""Long work tells how far it is: a function, the log, a terminal, a pipe, and nobody by default."""

import io
import logging

import pytest

import serpentail as st
from serpentail.stages import Stage, Told

TINY = {"tail": "articulated", "segments": 1, "links": 1, "functions": ["energy", "momentum"]}


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


def test_a_function_is_told_each_stage(tmp_path, monkeypatch):
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path))
    told = []
    with st.progress(told.append):
        st.build(**TINY)
    ends = [now for now in told if now.ended]
    assert [now.stage for now in ends] == ["derive", "compile"]
    assert ends[0].what == "articulated_m1_n1" and ends[0].left == 0
    parts = [now.done for now in told if now.stage == "derive" and now.done is not None]
    assert parts == sorted(parts) and all(0 <= part < 1 for part in parts)
    count = len(told)
    st.build(**TINY)
    assert len(told) == count


def test_what_it_raises_ends_the_work(tmp_path, monkeypatch):
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path))

    def enough(now):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError), st.progress(enough):
        st.build(**TINY)
    assert st.build(**TINY).segments == 1  # nothing is left in the way


def test_the_estimate_is_of_what_is_left():
    assert st.Progress("plan", "", 0.25, 10.0).left == 30.0
    assert st.Progress("plan", "", None, 10.0).left is None
    assert str(st.Progress("plan", "rat", 0.25, 10.0)) == "plan rat: 25%, 10 s, 30 s left"
    assert str(st.Progress("plan", "rat", 0.25, 10.0, ended=True)) == "plan rat: 10.0 s"


def stages(stream, clock):
    """A stage of half a second, and one of a minute."""
    hook = Told(stream)
    with st.progress(hook):
        with Stage("compile", "short") as stage:
            clock(0.5)
            stage.tell(0.5)
        with Stage("derive", "long") as stage:
            for part in range(60):
                clock(1)
                stage.tell(part / 60)


def test_a_pipe_has_few_lines(clock):
    stream = io.StringIO()
    stages(stream, clock)
    lines = stream.getvalue().splitlines()
    assert lines[0] == "derive long: 1 s so far" and lines[-1] == "derive long: 60.0 s"
    assert len(lines) == 2 + 5 and lines[1] == "derive long: 17%, 11 s, 55 s left"


def test_a_terminal_has_one_line_that_ends_empty(clock):
    stream = Terminal()
    stages(stream, clock)
    text = stream.getvalue()
    assert "\n" not in text and "short" not in text and text.count("derive long") == 60
    assert text.rsplit("\r", 2)[1].isspace() and text.endswith("\r")


def test_nobody_is_told_by_default(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path))
    st.build(**TINY)
    assert capsys.readouterr() == ("", "")


def test_the_log_has_the_end_of_each_stage(caplog):
    with caplog.at_level(logging.INFO, "serpentail"):
        with Stage("compile", "rat.c"):
            pass
        with pytest.raises(KeyError), Stage("derive", "rat"):
            raise KeyError
    assert caplog.messages == ["compile rat.c: 0.0 s", "derive rat: 0.0 s, ended by KeyError"]

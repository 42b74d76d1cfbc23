"""The store of a sweep: each row once, whole, and by one writer."""

import sqlite3

import pytest

import serpentail as st
from serpentail.sweeps.store import Row, Store

ROW = Row("k", '{"x":1}', '{"y":2}', None, 0.5)


def test_a_row_that_is_there_stays(tmp_path):
    store = Store(tmp_path / "s.db")
    store.add([ROW, Row("l", "{}", None, "wrong", 0.1)])
    store.add([ROW._replace(outcome='{"y":3}'), Row("m", "{}", "{}", None, 0.1)])
    assert store.rows(["k"]) == {"k": ROW}
    assert store.known(["k", "l", "n"]) == {"k": True, "l": False}
    store.close()
    again = Store(tmp_path / "s.db")
    assert set(again.rows("klmn")) == set("klm")
    again.forget(["l"])
    assert again.known("klm") == {"k": True, "m": True}
    again.close()


def test_rows_are_written_all_or_none(tmp_path):
    store = Store(tmp_path / "s.db")
    with pytest.raises(st.NotWritten):
        store.add([ROW, Row("l", None, None, None, 0.1)])  # a row without a point
    assert store.known("kl") == {}
    store.close()


def test_one_process_writes(tmp_path):
    first, second = Store(tmp_path / "s.db"), Store(tmp_path / "s.db")
    with first.writing():
        with pytest.raises(st.SweepError, match="another process is writing"), second.writing():
            pass
        first.add([ROW])
        assert second.known("k") == {"k": True}  # who reads may
    with second.writing():
        pass
    first.close()
    second.close()


def test_other_files_are_refused(tmp_path):
    (tmp_path / "text.db").write_text("no database at all, but a text of some length\n" * 50)
    with pytest.raises(st.SweepError, match="is not a store"):
        Store(tmp_path / "text.db")
    other = sqlite3.connect(tmp_path / "other.db")
    other.execute("create table t (x)")
    other.commit()
    other.close()
    with pytest.raises(st.SweepError, match="another program's"):
        Store(tmp_path / "other.db")
    with pytest.raises(st.SweepError, match="is a folder"):
        Store(tmp_path)


def test_many_keys_are_read(tmp_path):
    store = Store(None)
    store.add([ROW._replace(key=str(k)) for k in range(1203)])
    assert len(store.rows(map(str, range(1203)))) == 1203
    store.close()

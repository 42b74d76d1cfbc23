"""Mutates scene files at random: each must be read, or refused with a reason."""

import contextlib
import io
import random
import warnings
from functools import partial
from pathlib import Path

import serpentail as st
from serpentail.cli import cli
from serpentail.scenes.file import read_scene, subtable
from serpentail.scenes.simulate import scenario_of
from serpentail_codegen.__main__ import parser, scene_of
from serpentail_codegen.scene.problems import SceneError

BYTES = (
    b"",
    b"\0",
    b"\xff",
    b"\xef\xbb\xbf",
    b"=",
    b"[",
    b"]",
    b"[[",
    b'"',
    b"'''",
    b"\\",
    b"#",
    b"\n",
    b"\r",
)
PIECES = (
    *BYTES,
    b"nan",
    b"-inf",
    b"1e999",
    b"1e308",
    b"-0.0",
    b"1e-320",
    b"9" * 30,
    b"0x7fffffffffffffff",
    b"true",
    b"{}",
    b"[]",
    b"[nan]",
    b"1979-05-27",
    b'"all"',
    b'"continuum"',
    b'"polar"',
    b'"float"',
    b"[" * 3000,
    b"links",
    b"name",
    b"[plan]",
    b"[simulate]",
    b"[parameters]",
    (b"segments = 10000\n"),
    b"contacts = [1]\n",
    b"functions = [[]]\n",
    b"\xc3\xa9",
)


def mutated(text: bytes, dice: random.Random) -> bytes:
    """Return bytes with one to three pieces replaced, removed or inserted."""
    for _ in range(dice.randint(1, 3)):
        first = dice.randrange(len(text) + 1)
        last = min(len(text), first + dice.choice([0, 1, 3, 12, 60]))
        piece = dice.choice([dice.choice(PIECES), text[dice.randrange(len(text) + 1) :][:30]])
        text = text[:first] + piece + text[last:]
    return text


def faults(
    files: list[Path], count: int, dice: random.Random, folder: Path, model: st.Model
) -> list[str]:
    """Return what so many mutated files raised besides refusals, read by the generator and by each
    verb of the runtime.

    model: the model for which motions of files with a table [simulate] are prepared, whatever model
    they describe.
    """
    found, sources = [], [path.read_bytes() for path in files]
    path = folder / "mutated.toml"
    for _ in range(count):
        path.write_bytes(mutated(dice.choice(sources), dice))
        for read in (
            generated,
            partial(refused, "plan"),
            partial(refused, "simulate"),
            partial(made_ready, model),
        ):
            try:
                with warnings.catch_warnings():
                    # a number that is read as given, and told to be unusual, is an answer
                    warnings.simplefilter("ignore", st.UnusualSize)
                    read(path)
            except Exception as error:
                found.append(f"{read}: {error!r} of {path.read_bytes()!r:.2000}")
    return found


def generated(path: Path) -> None:
    """Read a scene as the generator does, up to the derivation."""
    with contextlib.suppress(SceneError):
        scene_of(parser().parse_args([str(path)]))


def refused(verb: str, path: Path) -> None:
    """Plan or simulate a scene with a folder that has no model: the file must be read and the
    folder refused.
    """
    empty = path.parent / "empty"
    empty.mkdir(exist_ok=True)
    with contextlib.redirect_stderr(io.StringIO()) as words:
        status = cli.main([verb, str(path), "--folder", str(empty)])
    if status != 2 or not words.getvalue().strip():
        raise AssertionError(f"status {status}, {words.getvalue()!r}")


def made_ready(model: st.Model, path: Path) -> None:
    """Prepare a scene's motion from its start, without settling, which may take long."""
    with contextlib.suppress(st.SerpentailError):
        tables, _ = read_scene(path, st.SimulationError)
        table = subtable(tables, "simulate", path, st.SimulationError)
        if isinstance(table.get("start"), dict):
            table["start"].pop("settle", None)
        scenario_of(model, table, path.parent)

"""The front door: make builds what is asked for, once, and says in one line what it cannot do."""

import json
import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.support.makes import away_from_make, stand_in
from tests.support.told import besides_progress

ROOT = Path(__file__).resolve().parents[2]
ORDER = ("TAIL=articulated", "M=1", "N=1", "FUNCTIONS=mass_matrix")
NAME = "articulated_m1_n1_fc4a05d"  # of these functions
UP_TO_DATE = rf"generated/{NAME}: up to date, \d+\.\d\d s\n"


@pytest.fixture
def tree(tmp_path):
    """A copy of what make builds from, with a stand-in for .venv that is ready."""
    for name in ("Makefile", "pyproject.toml"):
        shutil.copy2(ROOT / name, tmp_path)
    for name in ("codegen", "scenes"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    stand_in(tmp_path)
    return tmp_path


@pytest.fixture
def make(tree):
    """Return a function that runs make there, away from a make that runs these tests."""

    def run(*arguments, **more):
        own = {name: value for name, value in away_from_make().items() if name != "CC"}
        own |= {"PYTHONPATH": str(tree / "codegen"), "LC_ALL": "C", "UV": "", **more}
        return subprocess.run(
            ["make", *arguments], cwd=tree, env=own, capture_output=True, text=True, check=False
        )

    return run


def lines(done):
    """The lines that make printed, with single spaces."""
    return [" ".join(line.split()) for line in done.stdout.splitlines()]


def commands(done):
    """The commands that make -n printed, as lists of words."""
    text = done.stdout.replace("\\\n", " ").replace("$(", " ").replace(")", " ")
    return [shlex.split(line) for line in text.splitlines()]


def built(tree):
    """Time of every file that a build wrote."""
    return {
        path: path.stat().st_mtime_ns for path in (tree / "generated").rglob("*") if path.is_file()
    }


def manifest(tree, name=NAME):
    return json.loads((tree / "generated" / name / "manifest.json").read_text())


def test_make_alone_is_help(tree, make):
    done = make()
    assert (done.returncode, besides_progress(done.stderr)) == (0, "")
    phony = re.search(r"^\.PHONY: (help .*)", (ROOT / "Makefile").read_text(), re.MULTILINE)
    for target in phony[1].split():
        assert target == "help" or re.search(rf"make {target}\b", done.stdout), target
    assert make("help").stdout == done.stdout
    assert not (tree / "generated").exists()


def test_plan_of_a_model(tree, make):
    done = make("-n", "model", "TAIL=articulated", "M=2", "N=2")
    assert (done.returncode, besides_progress(done.stderr)) == (0, "")
    (words,) = commands(done)
    wanted = "-m serpentail_codegen --tail articulated --segments 2 --links 2"
    assert " ".join(words).startswith(f"said= .venv/bin/python {wanted} ")
    assert not (tree / "generated").exists()


@pytest.mark.parametrize("size", [("M=1", "N=3"), ()])
def test_plan_of_options(make, size):
    options = ("REAL=float", "EMISSION=loops", "BAKED=1", "FUNCTIONS=energy,momentum")
    (words,) = commands(make("-n", "model", *size, *options))
    wanted = (
        "--real float --emission loops --baked --functions energy,momentum "
        "--tail articulated --segments 1 --links 3"
    )
    assert f"-m serpentail_codegen {wanted} " in " ".join(words)


def test_plan_of_a_scene(make):
    (words,) = commands(make("-n", "model", "SCENE=my scenes/it's.toml", "REAL=float"))
    assert words[3:7] == ["serpentail_codegen", "--real", "float", "--"]
    assert words[7] == "my scenes/it's.toml"


def test_second_make_rebuilds_nothing(tree, make):
    first = make("model", *ORDER)
    assert (first.returncode, besides_progress(first.stderr)) == (0, "")
    assert re.search(rf"generated/{NAME}: \d+ files written", first.stdout)
    assert f"{NAME}: 1 x 1 links, nq 9, nv 8, double" in first.stdout
    before = built(tree)
    for path in (tree / "codegen").rglob("*"):
        path.touch()
    second = make("model", *ORDER)
    assert (second.returncode, besides_progress(second.stderr)) == (0, "")
    assert re.fullmatch(UP_TO_DATE, second.stdout)
    assert built(tree) == before


@pytest.mark.slow
def test_every_choice_of_options_has_a_folder_of_its_own(tree, make):
    choices = {
        "": [],
        "_float": ["REAL=float"],
        "_loops_reproducible_baked": ["EMISSION=loops", "PROFILE=reproducible", "BAKED=1"],
    }
    for suffix, options in choices.items():
        done = make("model", *ORDER, *options)
        assert (done.returncode, besides_progress(done.stderr)) == (
            0,
            "",
        ) and "files written" in done.stdout
        name = NAME.replace("_f", f"{suffix}_f")
        assert manifest(tree, name)["prefix"] == name
    up_to_date = UP_TO_DATE.replace(NAME, r"\w+")
    for options in choices.values():
        assert re.fullmatch(up_to_date, make("model", *ORDER, *options).stdout)
    assert manifest(tree)["real"] == "double"


def test_programs_of_make_use_the_folder_that_the_generator_names(tree, make):
    for order, name in [
        (("verify", "M=2"), "articulated_m2_n3"),
        (("verify", "REAL=float"), "articulated_m1_n3_float"),
        (("verify", "TAIL=continuum", "FUNCTIONS=all"), "continuum_m1_all"),
        (("embedded",), "articulated_m1_n3_float"),
        (("embedded", "CPU=m7", "PROFILE=reproducible"), "articulated_m1_n3_reproducible"),
        (("embedded", "SCENE=scenes/contact_m1_n3.toml"), "contact_m1_n3_float"),
    ]:
        *_, program = make("-n", *order).stdout.splitlines()
        asked = re.search(r'"\$\((.*)\)"', program)[1]
        own = os.environ | {"PYTHONPATH": str(tree / "codegen")}
        told = subprocess.run(
            asked, shell=True, cwd=tree, env=own, capture_output=True, text=True, check=True
        )
        assert told.stdout == f"generated/{name}\n"
    assert not (tree / "generated").exists()


@pytest.mark.slow
def test_changed_generator_looks_again_and_writes_only_what_differs(tree, make):
    assert make("model", *ORDER).returncode == 0
    before = built(tree)
    link = tree / "codegen" / "serpentail_codegen" / "mechanics" / "link.py"
    link.write_text(link.read_text() + "# a remark\n")
    done = make("model", *ORDER)
    assert done.returncode == 0 and f"generated/{NAME}: up to date" in done.stdout
    stamps = {tree / "generated" / ".stamps" / f"{NAME}{told}" for told in ("", ".told")}
    after = built(tree)
    assert {path for path in after if after[path] != before[path]} == stamps
    template = (
        tree
        / "codegen"
        / "serpentail_codegen"
        / "targets"
        / "c"
        / "templates"
        / "model"
        / "model.c.jinja"
    )
    template.write_text("/* another start */\n" + template.read_text())
    assert "files written" in make("model", *ORDER).stdout
    source = tree / "generated" / NAME / "src" / f"{NAME}.c"
    assert source.read_text().startswith("/* another start */\n")


@pytest.mark.slow
def test_an_older_scene_that_is_restored_rebuilds(tree, make):
    place = tree / "my scenes" / "it's.toml"
    place.parent.mkdir()
    text = 'name = "own"\nkind = "articulated"\nsegments = 1\nlinks = 1\n'
    first, second = text + 'functions = ["energy"]\n', text.replace("links = 1", "links = 2")
    for links, scene in [(1, first), (2, second), (1, first)]:
        place.write_text(scene)
        os.utime(place, (0, 0))
        done = make("model", f"SCENE={place.relative_to(tree)}")
        assert done.returncode == 0 and f"own: 1 x {links} links" in done.stdout
        assert manifest(tree, "own")["dimensions"]["links"] == links


@pytest.mark.slow
def test_what_was_edited_or_lost_is_made_again(tree, make):
    assert make("model", *ORDER).returncode == 0
    folder = tree / "generated" / NAME
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    (folder / "src" / f"{NAME}.c").write_text("edited")
    (folder / "README.md").unlink()
    assert "files written" in make("model", *ORDER).stdout
    assert {path: path.read_bytes() for path in before} == before


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["M=0"], "segments: value 0: needs a whole number, 1 or above"),
        (["M=-1"], "segments: value -1: needs a whole number, 1 or above"),
        (["N=0"], "links: value 0: needs a whole number, 1 or above"),
        (["M=abc"], "argument --segments: invalid int value: 'abc'"),
        (["M=1.5"], "argument --segments: invalid int value: '1.5'"),
        (["N="], "argument --links: invalid int value: ''"),
        (["TAIL=snake"], "argument --tail: invalid choice: 'snake' (choose from 'articulated'"),
        (["N=10001"], "more than 10000 links in all; choose fewer segments or links"),
        (["REAL=half"], 'real: value \'half\': needs "double" or "float"'),
        (["EMISSION=fast"], "emission: value 'fast': needs "),
        (["FUNCTIONS=energi"], "functions[0]: value 'energi': unknown; did you mean 'energy'?"),
        (["SCENE=missing.toml"], "scene file: value 'missing.toml': cannot be read: No such file"),
        (["SCENE=/dev/zero"], "scene file: value '/dev/zero': cannot be read: no regular file"),
        (["SCENE=--help"], "scene file: value '--help': cannot be read: No such file"),
        (["SCENE=Makefile"], "scene file: value 'Makefile': cannot be read as TOML"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_wrong_order_is_one_readable_line(tree, make, options, words):
    done = make("model", *options)
    assert done.returncode == 2
    (line,) = (line for line in done.stderr.splitlines() if words in line)
    assert "Traceback" not in done.stderr and len(line) < 130
    assert not list((tree / "generated").glob("[a-z]*"))


def test_unknown_target(make):
    done = make("modle")
    assert done.returncode == 2 and "No rule to make target 'modle'" in done.stderr


@pytest.mark.slow
def test_failed_build_is_tried_again(tree, make):
    failed = make("model", *ORDER, CC="no-such-cc", SERPENTAIL_CACHE=str(tree / "cache"))
    assert (
        failed.returncode == 2 and "CC='no-such-cc' does not work as a C compiler" in failed.stderr
    )
    again = make("model", *ORDER)
    assert again.returncode == 0 and "mass_matrix" in again.stdout


def test_clean_removes_what_was_made(tree, make):
    kept = ("generated/README.md", "generated/golden_loops/src")  # part of the checkout
    for name in ("generated/x", "generated/.stamps", "output", *kept):
        (tree / name).mkdir(parents=True)
    sources = sorted((tree / "codegen").rglob("*.py"))
    assert make("clean").returncode == 0
    left = {path.name for path in (tree / "generated").iterdir()}
    assert left == {"README.md", "golden_loops"} and not (tree / "output").exists()
    assert (tree / "generated/golden_loops/src").is_dir()
    assert sorted((tree / "codegen").rglob("*.py")) == sources != []


def test_old_environment_is_installed_again(tree, make):
    """A newer pyproject.toml leads to pip, which this stand-in refuses."""
    os.utime(tree / ".venv" / ".draws", (0, 0))
    done = make("model", *ORDER)
    assert done.returncode == 2 and "no pip in here" in done.stderr
    assert not (tree / "generated" / NAME).exists()

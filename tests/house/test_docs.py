"""The documents: their examples run, what they name exists, and their links lead somewhere."""

import importlib
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import simpson

import serpentail as st
from serpentail.cli import ROOMS, arguments_of
from serpentail_codegen.scene.parameters import PARAMETERS
from serpentail_codegen.scene.parse import parse_scene
from serpentail_codegen.scene.signatures.table import ALL
from tests.support.told import besides_progress

ROOT = Path(__file__).parents[2]
DOCUMENTS = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "CHANGELOG.md",
    *sorted(ROOT.glob("docs/*.md")),
    *sorted(ROOT.glob("docs/release_notes/*.md")),
]
README = DOCUMENTS[0].read_text(encoding="utf-8")
CODEGEN, RUNTIME = ROOT / "codegen" / "serpentail_codegen", ROOT / "runtime" / "serpentail"
MADE = ("generated/", "output/", "include/", "src/", "example/")  # folders that commands make
# files that commands make
YOURS = ("fall.c", "articulated_m3_n4.h", "rat.toml", "drop.toml", "study.toml")
YOURS += ("f.c", "rat.c", "rat_host.c", "rat.h")

every_document = pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)


def block(language: str, start: str = "") -> str:
    """The README's fenced block of a language that starts with a text; there is one."""
    blocks = re.findall(rf"^```{language}\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
    (found,) = [text for text in blocks if text.startswith(start)]
    return found


def code(document: Path) -> list[str]:
    """Fenced lines, without comments, and code spans of a document."""
    text = document.read_text(encoding="utf-8")
    fenced = re.findall(r"^```\w*\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    lines = [line.split("#")[0] for lines in fenced for line in lines.splitlines()]
    return lines + re.findall(
        r"`([^`\n]+)`", re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    )


def run(command: list[str], folder: Path) -> str:
    """What a command prints, once it has ended well and without a complaint."""
    finished = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    told = besides_progress(finished.stderr)
    assert (finished.returncode, told) == (0, ""), told
    return finished.stdout


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A folder in which `make model TAIL=articulated M=3 N=4` was run."""
    path = tmp_path_factory.mktemp("readme")
    size = ["--tail", "articulated", "--segments", "3", "--links", "4"]
    run([sys.executable, "-m", "serpentail_codegen", *size], path)
    return path


# Examples


def test_python_example_runs(folder):
    printed = run([sys.executable, "-c", block("python")], folder)
    residual, flight = re.fullmatch(
        r"H v_dot \+ C = \[(.*?)\]\n(.*)\n", printed, re.DOTALL
    ).groups()
    assert np.abs(np.array(residual.split(), float)).max() < 1e-12
    height, damped = map(float, re.search(r"height (\S+) m, (\S+) J", flight).groups())
    assert height == pytest.approx(
        0.3 + 2 * 0.5 - 9.8 / 2 * 0.5**2, abs=0.1
    )  # of B, not of the centre of mass
    assert 0 < damped < 0.1


def test_c_example_compiles_without_warnings_and_runs(folder):
    (folder / "fall.c").write_text(block("c"), encoding="utf-8")
    command = shlex.split(block("sh", "cc ").replace("\\\n", " "))
    run([*command, "-pedantic", "-Wall", "-Wextra", "-Werror"], folder)
    printed = run([str(folder / "fall")], folder)

    model = st.load(folder / "generated" / "articulated_m3_n4")
    q = np.array([0, 0, 0, 1, 0, 0, 0, 0.5, 0, 0, 0, 0, 0])
    v_dot = model.forward_dynamics(q, np.zeros(model.nv), np.array([1e-3, 0, 0, 0, 0, 0]))
    expected = f"status 0, p_ddot_z = {v_dot[2]:g} m/s^2, alpha_1_ddot = {v_dot[6]:g} rad/s^2\n"
    assert printed == expected


def test_examples_are_short():
    assert len(block("python").splitlines()) <= 12
    assert len(block("c").splitlines()) <= 15


def test_scene_example_is_a_scene_that_can_be_simulated():
    scene = parse_scene(tomllib.loads(block("toml")), "example")
    assert set(scene.functions) == {"forward_dynamics", "rollout", "energy", "momentum"}


@pytest.mark.slow
def test_demo_runs_anywhere_and_writes_its_files(tmp_path):
    printed = run([sys.executable, str(ROOT / "examples" / "demo.py"), "demo"], tmp_path)
    for scene in ("kangaroo_rat_m1_n3", "kangaroo_rat_m3_n4"):
        flight = st.Trajectory.load(tmp_path / "demo" / f"{scene}.npz")
        assert flight.t[-1] == pytest.approx(0.58)
        damped = simpson(-np.sum(flight.tau * flight.v[:, 6:], axis=1), x=flight.t)
        assert flight.energy[0] - flight.energy[-1] == pytest.approx(damped, rel=1e-3)
        for picture in ("film", "time"):
            assert (tmp_path / "demo" / f"{scene}_{picture}.png").read_bytes()[:4] == b"\x89PNG"
    for picture in ("kick_film.png", "righting_film.png"):
        assert (tmp_path / "demo" / picture).read_bytes()[:4] == b"\x89PNG"
    assert (tmp_path / "demo" / "righting.gif").read_bytes()[:6] == b"GIF89a"
    assert "0.00 deg with the planned tail" in printed
    drifts = re.findall(r"constant to (\S+),", printed)
    differences = re.findall(r"differ by (\S+) at most", printed)
    assert len(drifts) == 4
    assert max(map(float, drifts)) < 1e-9
    assert max(map(float, differences)) < 1e-8


# Names


@every_document
def test_make_targets_and_variables_exist(document):
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = re.findall(r"^([a-z][a-z-]*):", makefile, re.MULTILINE)
    variables = re.findall(r"^(\w+) *\??:?=", makefile, re.MULTILINE) + re.findall(
        r"\$\((\w+)\)", makefile
    )
    for line in code(document):
        for call in re.findall(r"^ *make\b(.*)", line):
            for word in call.split():
                name, given, _ = word.partition("=")
                assert name in (variables if given else targets), line


@every_document
def test_files_exist(document):
    text = re.sub(r"https?://\S+", "", document.read_text(encoding="utf-8"))
    names = re.findall(r"(?<![\w<>*/.-])[\w./-]+\.(?:py|toml|md|jinja|png|c|h)\b", text)
    names += [span for span in code(document) if re.fullmatch(r"[\w.-]+(/[\w.-]*)+", span)]
    homes = (ROOT, document.parent, CODEGEN, RUNTIME)
    missing = [
        name
        for name in names
        if not name.startswith(MADE) and not any((home / name).exists() for home in homes)
    ]
    assert [name for name in missing if name not in YOURS] == []


MODULES: dict[str, list[str]] = {}  # of the generator, by their last name
for path in sorted(CODEGEN.rglob("[a-z]*.py")):
    if path.stem != "model":  # which documents call a loaded model
        name = ".".join(path.relative_to(CODEGEN.parent).with_suffix("").parts)
        MODULES.setdefault(path.stem, []).append(name)


@every_document
def test_functions_exist(document):
    for span in code(document):
        for module, name in re.findall(
            rf"(?<![\w./])({'|'.join(MODULES)})\.(?!py\b|toml\b|md\b|json\b|jinja\b|c\b|h\b)(\w+)",
            span,
        ):
            assert any(hasattr(importlib.import_module(m), name) for m in MODULES[module]), span
        for name in re.findall(r"\b(?:st|serpentail)\.(?!cli\b)(\w+)", span):
            assert name in st.__all__, span


@every_document
def test_methods_exist(document, folder):
    model = st.load(folder / "generated" / "articulated_m3_n4")
    for span in code(document):
        for name in re.findall(r"(?<![\w/])model\.(?!py\b)(\w+)", span):
            assert hasattr(type(model), name) or name in vars(model), span


@every_document
def test_verbs_exist(document):
    verbs = {verb for room in ROOMS.values() for verb in room}
    for span in code(document):
        for words in re.findall(r"^(?:\.venv/bin/)?serpentail (.*)", span):
            given = shlex.split(words.split(" > ")[0], comments=True)
            if given[1:]:  # a command, with arguments that it takes
                assert arguments_of(given).verb == given[0]
            else:
                assert given[0].startswith("-") or given[0] in verbs


@every_document
def test_documents_name_no_machine(document):
    assert (
        re.findall(
            r"(?<![\w.~])/(?:home|root|tmp|work|Users)/", document.read_text(encoding="utf-8")
        )
        == []
    )


# Contents


@every_document
def test_links_resolve(document):
    text = document.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        place = target.split("#")[0]
        assert target.startswith("https://") or (document.parent / place).exists(), target
    notes = re.findall(r"\[\^(\w+)\](:?)", text)
    assert {name for name, colon in notes if colon} == {name for name, colon in notes if not colon}


def test_pictures_are_small_and_used():
    for picture in (ROOT / "docs" / "images").iterdir():
        assert picture.stat().st_size < 200_000
        assert any(
            f"images/{picture.name}" in document.read_text(encoding="utf-8")
            for document in DOCUMENTS
        )


def test_benchmark_block_can_be_filled():
    assert (
        len(re.findall(r"^<!-- bench -->$.*?^<!-- /bench -->$", README, re.MULTILINE | re.DOTALL))
        == 1
    )
    assert README.count("bench -->") == 2


def test_quoted_errors_are_the_ones_raised():
    sources = "".join(
        path.read_text(encoding="utf-8")
        for home in (CODEGEN, RUNTIME)
        for path in home.rglob("*.py")
    )
    rows = re.findall(r"^\| `(.*?)` \|", README.split("## Errors you may meet")[1], re.MULTILINE)
    assert rows
    for message in rows:
        for part in re.split(r"\.\.\.|'[^']*'|\([^)]*\)", message):
            assert part.strip() in sources, message


def test_changelog_names_every_emitted_function():
    lines = re.findall(
        r"^- (`.*?):", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    named = {name for line in lines for name in re.findall(r"`(\w+)`", line)}
    assert set(ALL) <= named


def test_theory_has_every_parameter_with_its_unit():
    rows = re.findall(
        r"^\| `(\w+)` \| ([^|]+) \|",
        (ROOT / "docs" / "theory.md").read_text(encoding="utf-8"),
        re.MULTILINE,
    )
    assert {(p.name, p.unit) for p in PARAMETERS} <= set(rows)

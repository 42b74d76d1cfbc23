"""The documents: what they name exists, and their links lead somewhere.  tests/docs runs them."""

import importlib
import re
import shlex
from pathlib import Path

import pytest

import serpentail as st
from serpentail.cli import ROOMS, arguments_of
from serpentail_codegen.scene.parameters import PARAMETERS
from serpentail_codegen.scene.signatures.table import ALL
from tests.docs.blocks import PAGES, blocks
from tests.support.models import model_folder

ROOT = Path(__file__).parents[2]
DOCUMENTS = list(PAGES.values())
CODEGEN, RUNTIME = ROOT / "codegen" / "serpentail_codegen", ROOT / "runtime" / "serpentail"
MADE = ("generated/", "output/", "include/", "src/", "example/")  # folders that commands make
# files that commands make
YOURS = ("fall.c", "articulated_m3_n4.h", "rat.toml", "drop.toml", "study.toml", "lizard.toml")
YOURS += ("flight.png", "swing.png", "./fall")
YOURS += ("f.c", "rat.c", "rat_host.c", "rat.h")

every_document = pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)


def code(document: Path) -> list[str]:
    """Fenced lines, without comments, and code spans of a document."""
    text = document.read_text(encoding="utf-8")
    lines = [line.split("#")[0] for each in blocks(document) for line in each.text.splitlines()]
    return lines + re.findall(
        r"`([^`\n]+)`", re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    )


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
def test_methods_exist(document):
    model = st.load(model_folder(1, 3), compiled=False)
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
    text = PAGES["benchmarks"].read_text(encoding="utf-8")
    assert (
        len(re.findall(r"^<!-- bench -->$.*?^<!-- /bench -->$", text, re.MULTILINE | re.DOTALL))
        == 1
    )
    assert text.count("bench -->") == 2


def test_quoted_errors_are_the_ones_raised():
    sources = "".join(
        path.read_text(encoding="utf-8")
        for home in (CODEGEN, RUNTIME)
        for path in home.rglob("*.py")
    )
    text = PAGES["errors"].read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(.*?)` \|", text, re.MULTILINE)
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


def test_the_glossary_has_every_word_of_the_house():
    words = PAGES["CONTRIBUTING"].read_text(encoding="utf-8").split("\n## Words\n")[1]
    rows = re.findall(r"^\| ([\w ]+?) \|", words.split("\n## ")[0], re.MULTILINE)
    glossary = PAGES["glossary"].read_text(encoding="utf-8")
    terms = {
        term
        for row in re.findall(r"^\| ([^|]+) \|", glossary, re.MULTILINE)
        for term in row.split(", ")
    }
    assert len(rows) > 30
    assert set(rows) - {"word"} - terms == set()

"""What the documents name exists, and their links lead somewhere."""

import importlib
import re
import shlex
from pathlib import Path

import serpentail as st
from serpentail.cli import ROOMS, arguments_of
from serpentail.model.model import Model
from serpentail_codegen.scene.parameters import PARAMETERS
from tests.docs.blocks import PAGES, ROOT, blocks
from tests.support import zoo
from tests.support.rows import row

CODEGEN, RUNTIME = ROOT / "codegen" / "serpentail_codegen", ROOT / "runtime" / "serpentail"
MADE = ("generated/", "output/", "include/", "src/", "example/")  # folders that commands make
# files that commands make
YOURS = {"fall.c", "articulated_m3_n4.h", "rat.toml", "drop.toml", "study.toml", "lizard.toml"}
YOURS |= {"flight.png", "swing.png", "./fall", "f.c", "rat.c", "rat_host.c", "rat.h"}
TEXTS = {path: path.read_text(encoding="utf-8") for path in PAGES.values()}


def code(document: Path) -> list[str]:
    """Fenced lines, without comments, and code spans of a document."""
    lines = [line.split("#")[0] for each in blocks(document) for line in each.text.splitlines()]
    outside = re.sub(r"^```.*?^```$", "", TEXTS[document], flags=re.MULTILINE | re.DOTALL)
    return lines + re.findall(r"`([^`\n]+)`", outside)


CODE = [(path, line) for path in TEXTS for line in code(path)]


def found(pattern: str):
    """Yield where a pattern is in the code of all documents: the document, and the match."""
    for path, line in CODE:
        for match in re.findall(pattern, line):
            yield path.name, match


def test_make_targets_and_variables_exist():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = re.findall(r"^([a-z][a-z-]*):", makefile, re.MULTILINE)
    variables = re.findall(r"^(\w+) *\??:?=|\$\((\w+)\)", makefile, re.MULTILINE)
    known = {name for pair in variables for name in pair}
    for page, call in found(r"^ *make\b(.*)"):
        with row(page, call):
            for word in call.split():
                name, given, _ = word.partition("=")
                assert name in (known if given else targets)


def test_files_exist():
    for document, text in TEXTS.items():
        own = re.sub(r"https?://\S+", "", text)
        names = re.findall(r"(?<![\w<>*/.-])[\w./-]+\.(?:py|toml|md|jinja|png|c|h)\b", own)
        names += [span for span in code(document) if re.fullmatch(r"[\w.-]+(/[\w.-]*)+", span)]
        homes = (ROOT, document.parent, CODEGEN, RUNTIME)
        names = {name for name in names if not name.startswith(MADE)} - YOURS
        with row(document.name):
            assert [n for n in names if not any((home / n).exists() for home in homes)] == []


def test_functions_and_methods_exist():
    modules: dict[str, list[str]] = {}  # of the generator, by their last name
    for path in sorted(CODEGEN.rglob("[a-z]*.py")):
        if path.stem != "model":  # which documents call a loaded model
            name = ".".join(path.relative_to(CODEGEN.parent).with_suffix("").parts)
            modules.setdefault(path.stem, []).append(name)
    ends = r"(?!py\b|toml\b|md\b|json\b|jinja\b|c\b|h\b)"
    for page, (module, name) in found(rf"(?<![\w./])({'|'.join(modules)})\.{ends}(\w+)"):
        with row(page, module, name):
            assert any(hasattr(importlib.import_module(m), name) for m in modules[module])
    for page, name in found(r"\b(?:st|serpentail)\.(?!cli\b)(\w+)"):
        with row(page, name):
            assert name in st.__all__
    model = st.load(zoo.folder("m1_n3"), compiled=False)
    for page, name in found(r"(?<![\w/])model\.(?!py\b)(\w+)"):
        with row(page, name):
            assert hasattr(Model, name) or name in vars(model)


def test_verbs_exist():
    verbs = {verb for room in ROOMS.values() for verb in room}
    for page, words in found(r"^(?:\.venv/bin/)?serpentail (.*)"):
        given = shlex.split(words.split(" > ")[0], comments=True)
        with row(page, words):
            if given[1:]:  # a command, with arguments that it takes
                assert arguments_of(given).verb == given[0]
            else:
                assert given[0].startswith("-") or given[0] in verbs


def test_links_resolve_and_no_machine_is_named():
    for document, text in TEXTS.items():
        with row(document.name):
            for target in re.findall(r"\]\(([^)\s]+)\)", text):
                place = target.split("#")[0]
                assert target.startswith("https://") or (document.parent / place).exists(), target
            notes = re.findall(r"\[\^(\w+)\](:?)", text)
            assert {n for n, colon in notes if colon} == {n for n, colon in notes if not colon}
            assert re.findall(r"(?<![\w.~])/(?:home|root|tmp|work|Users)/", text) == []


def test_tables_begin_with_their_header():
    for document, text in TEXTS.items():
        outside = re.sub(r"(?ms)^```.*?^```$", "", text)
        for table in re.findall(r"(?m)(?:^\|.*\n)+", outside):
            with row(document.name):
                assert re.match(r".*\n\|(?: ?-+:? ?\|)+\n", table), table


def test_pictures_are_small_and_used():
    for picture in (ROOT / "docs" / "images").iterdir():
        with row(picture.name):
            assert picture.stat().st_size < 200_000
            assert any(f"images/{picture.name}" in text for text in TEXTS.values())


def test_benchmark_block_can_be_filled():
    text = TEXTS[PAGES["benchmarks"]]
    (block,) = re.findall(r"(?ms)^<!-- bench -->$.*?^<!-- /bench -->$", text)
    assert block and text.count("bench -->") == 2


def test_theory_has_every_parameter_with_its_unit():
    rows = re.findall(r"^\| `(\w+)` \| ([^|]+) \|", TEXTS[PAGES["theory"]], re.MULTILINE)
    assert {(p.name, p.unit) for p in PARAMETERS} <= set(rows)


def test_every_public_name_is_in_the_reference():
    listed = re.findall(r"^   ([A-Za-z_]+)$", TEXTS[PAGES["api"]], re.MULTILINE)
    assert sorted(listed) == sorted(st.__all__)

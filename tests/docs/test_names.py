"""What the documents name exists, their links lead somewhere, and their tables are true.

``make golden`` writes docs/functions.md anew.
"""

import ast
import re
import shlex
from pathlib import Path

import serpentail as st
from serpentail.cli.cli import ROOMS, arguments_of
from serpentail.model.model import Model
from serpentail_codegen.functions.tail import Tail
from serpentail_scene.parameters import PARAMETERS
from serpentail_scene.purposes import PURPOSES
from serpentail_scene.signatures.table import ALL, SIGNATURES
from tests.docs.running import PAGES, ROOT, blocks
from tests.support import zoo
from tests.support.rows import row

CODEGEN, RUNTIME = ROOT / "codegen" / "serpentail_codegen", ROOT / "runtime" / "serpentail"
MADE = ("generated/", "output/", "include/", "src/", "example/")  # folders that commands make
# files that commands make
YOURS = {"fall.c", "articulated_m3_n4.h", "rat.toml", "drop.toml", "study.toml", "lizard.toml"}
YOURS |= {"flight.png", "swing.png", "./fall", "f.c", "rat.c", "rat_host.c", "rat.h"}
TEXTS = {path: path.read_text(encoding="utf-8") for path in PAGES.values()}
FENCED = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)


def code(document: Path) -> list[str]:
    """Fenced lines, without comments, and code spans of a document."""
    lines = [line.split("#")[0] for each in blocks(document) for line in each.text.splitlines()]
    return lines + re.findall(r"`([^`\n]+)`", FENCED.sub("", TEXTS[document]))


CODE = [(path, line) for path in TEXTS for line in code(path)]


def found(pattern: str):
    """Yield where a pattern is in the code of all documents: the document, and the match."""
    for path, line in CODE:
        for match in re.findall(pattern, line):
            yield path.name, match


def test_make_targets_and_variables_and_verbs_exist():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = re.findall(r"^([a-z][a-z-]*):", makefile, re.MULTILINE)
    variables = re.findall(r"^(\w+) *\??:?=|\$\((\w+)\)", makefile, re.MULTILINE)
    known = {name for pair in variables for name in pair}
    for page, call in found(r"^ *make\b(.*)"):
        with row(page, call):
            for word in call.split():
                name, given, _ = word.partition("=")
                assert name in (known if given else targets)
    verbs = {verb for room in ROOMS.values() for verb in room}
    for page, words in found(r"^(?:\.venv/bin/)?serpentail (.*)"):
        given = shlex.split(words.split(" > ")[0], comments=True)
        with row(page, words):
            if given[1:]:  # a command, with arguments that it takes
                assert arguments_of(given).verb == given[0]
            else:
                assert given[0].startswith("-") or given[0] in verbs


def test_files_exist():
    for document, text in TEXTS.items():
        own = re.sub(r"https?://\S+", "", text)
        names = re.findall(r"(?<![\w<>*/.-])[\w./-]+\.(?:py|toml|md|jinja|png|c|h)\b", own)
        names += [span for span in code(document) if re.fullmatch(r"[\w.-]+(/[\w.-]*)+", span)]
        homes = (ROOT, ROOT / "codegen", document.parent, CODEGEN, RUNTIME)
        names = {name for name in names if not name.startswith(MADE)} - YOURS
        with row(document.name):
            assert [n for n in names if not any((home / n).exists() for home in homes)] == []


def test_names_exist_and_theory_has_every_parameter():
    for page, name in found(r"\b(?:st|serpentail)\.(?!cli\b)(\w+)"):
        with row(page, name):
            assert name in st.__all__
    model = st.load(zoo.folder("m1_n3"), compiled=False)
    for page, name in found(r"(?<![\w/])model\.(?!py\b)(\w+)"):
        with row(page, name):
            assert hasattr(Model, name) or name in vars(model)
    listed = re.findall(r"^   ([A-Za-z_]+)$", TEXTS[PAGES["api"]], re.MULTILINE)
    assert sorted(listed) == sorted(st.__all__)
    rows = re.findall(r"^\| `(\w+)` \| ([^|]+) \|", TEXTS[PAGES["theory"]], re.MULTILINE)
    assert {(p.name, p.unit) for p in PARAMETERS} <= set(rows)


def test_links_resolve_and_no_machine_is_named():
    for document, text in TEXTS.items():
        with row(document.name):
            for target in re.findall(r"\]\(([^)\s]+)\)", text):
                place = target.split("#")[0]
                assert target.startswith("https://") or (document.parent / place).exists(), target
            assert re.findall(r"(?<![\w.~])/(?:home|root|tmp|work|Users)/", text) == []


# The table of equations: a row for each; its functions exist and name it.

EQUATIONS = [*map(str, range(1, 51)), *(f"A{k}" for k in range(1, 15))]  # text, Appendix A
NAMES = r"`[A-Za-z_][\w.]*`"
PLACE = rf"`([\w./]+\.(?:py|toml|jinja))`(?:: ({NAMES}(?:, {NAMES})*))?"  # `file`: `name`, `name`


def text_of(file: str, name: str | None) -> str:
    """What a file, told from the root or from a package, says of a name; all if not Python's."""
    (path,) = (home / file for home in (ROOT, CODEGEN, RUNTIME) if (home / file).is_file())
    source = path.read_text(encoding="utf-8")
    if not file.endswith(".py"):
        assert name is None or f"_{name}(" in source, f"{name} is not there"
        return source
    assert name is not None, f"{file}: which function?"
    return prose(source, name)


def prose(source: str, name: str) -> str:
    """The text of a function, a class or a method `Class.method`, comments as its prose."""
    node = ast.parse(source)
    for part in name.split("."):
        inside = [entry for entry in node.body if getattr(entry, "name", None) == part]
        assert inside, f"{name} is not there"
        node = inside[0]
    return (ast.get_source_segment(source, node) or "").replace("#", " ")


def named(text: str) -> set[str]:
    """Numbers that a text names, such as "Eq. 12", "Eqs. 5, 7 to 9", "Eqs. 5-8", "A7"."""
    text, found = " ".join(text.split()), set()
    lists = re.findall(r"\bEqs?\. (A?\d+(?:(?:, and |, | and | to |-)A?\d+)*)", text)
    lists += re.findall(r"\bA\d+(?:(?:, | and | to |-)A\d+)*", text)
    for first, last in re.findall(r"(A?\d+)(?:(?: to |-)(A?\d+))?", "; ".join(lists)):
        letter = first.rstrip("0123456789")
        least, most = (int(end.lstrip("A")) for end in (first, last or first))
        found |= {f"{letter}{k}" for k in range(least, most + 1)}
    return found


def test_each_equation_has_one_true_row_in_order():
    table = TEXTS[PAGES["theory"]].split("\n## Equations\n")[1].split("\n## ")[0]
    # number and place of each row, between them what the equation gives, after them what differs
    cells = r"^\| (?:Eq\. )?(A?\d+) \|[^|]+\| ([^|]+) \|[^|]*\|$"
    rows = re.findall(cells, table, re.MULTILINE)
    assert [number for number, _ in rows] == EQUATIONS
    for number, where in rows:
        places = re.findall(PLACE, where)
        assert places, number
        for file, names in places:
            for name in re.findall(r"`([\w.]+)`", names) or [None]:
                with row(number, file, name):
                    assert number in named(text_of(file, name))


# The page of functions.

BELOW = "The shapes below use these names:\n"


def page_of_functions(page: str) -> str:
    """Return the page with what is below its head made anew."""
    head = page.partition(BELOW)[0]
    arguments = [a for name in ALL for a in (*SIGNATURES[name].inputs, *SIGNATURES[name].outputs)]
    names = dict.fromkeys(n for a in arguments for n in a.sizes if isinstance(n, str))
    sizes = [f"- `{name}`: {' '.join(getattr(Tail, name).__doc__.split())}" for name in names]
    groups = dict.fromkeys(SIGNATURES[name].group for name in ALL)
    return "\n".join(
        [head + BELOW, *sizes, "", *(line for group in groups for line in section(group))]
    )


def section(group: str) -> list[str]:
    """The functions of a group that a scene may name."""
    lines = [f"## {group.capitalize()}", ""]
    for name in ALL:
        signature = SIGNATURES[name]
        if signature.group == group:
            purposes = ", ".join(p for p, names in PURPOSES.items() if name in names)
            needs = f"needs {signature.needs}" if signature.needs else ""
            notes = "; ".join(filter(None, (purposes, needs)))
            lines += [f"### `{name}`", "", signature.doc + (f" ({notes})" if notes else ""), ""]
            lines += [of_argument("in", each) for each in signature.inputs]
            lines += [of_argument("out", each) for each in signature.outputs]
            lines += [""] if signature.outputs else []
    return lines


def of_argument(kind: str, argument) -> str:
    shape = ", ".join(map(str, argument.sizes)) + ("," if len(argument.sizes) == 1 else "")
    return f"- {kind} `{argument.name}` ({shape}): {argument.meaning}"


def test_the_page_of_functions_is_that_of_the_signatures(request):
    path = ROOT / "docs" / "functions.md"
    page = path.read_text(encoding="utf-8")
    made = page_of_functions(page)
    if request.config.getoption("--update-golden"):
        path.write_text(made, encoding="utf-8")
    else:
        assert page == made, "run `make golden`"

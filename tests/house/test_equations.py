"""The table of equations in docs/theory.md: a row for each; its functions exist and name it."""

import ast
import io
import re
import tokenize
from pathlib import Path

from tests.support.rows import row

ROOT = next(folder for folder in Path(__file__).parents if (folder / "pyproject.toml").exists())
HOMES = (ROOT, ROOT / "codegen" / "serpentail_codegen", ROOT / "runtime" / "serpentail")
THEORY = (ROOT / "docs" / "theory.md").read_text(encoding="utf-8")

EQUATIONS = [*map(str, range(1, 51)), *(f"A{k}" for k in range(1, 15))]  # text, Appendix A
TABLE = THEORY.split("\n## Equations\n")[1].split("\n## ")[0]
# number and place of each row, between them what the equation gives, after them what differs
ROWS = re.findall(r"^\| (?:Eq\. )?(A?\d+) \|[^|]+\| ([^|]+) \|[^|]*\|$", TABLE, re.MULTILINE)
NAMES = r"`[A-Za-z_][\w.]*`"
PLACE = rf"`([\w./]+\.(?:py|toml|jinja))`(?:: ({NAMES}(?:, {NAMES})*))?"  # `file`: `name`, `name`


def places(where: str) -> list[tuple[str, str | None]]:
    """Files that a row names, each with one of its names; None where it names a file alone."""
    found = []
    for file, names in re.findall(PLACE, where):
        found += [(file, name) for name in re.findall(r"`([\w.]+)`", names)] or [(file, None)]
    return found


def path_of(file: str) -> Path:
    """The file, which is told from the root or from one of the packages."""
    found = [home / file for home in HOMES if (home / file).is_file()]
    assert len(found) == 1, f"{file} is there {len(found)} times"
    return found[0]


def definition(tree: ast.Module, name: str) -> ast.AST | None:
    """The function, the class or the method `Class.method` of a module."""
    node = tree
    for part in name.split("."):
        kinds = (ast.FunctionDef, ast.ClassDef)
        inside = [entry for entry in node.body if isinstance(entry, kinds) and entry.name == part]
        if not inside:
            return None
        node = inside[0]
    return node


def prose(source: str, name: str) -> str:
    """Docstrings and comments of a function or a class."""
    node = definition(ast.parse(source), name)
    assert node is not None, f"{name} is not there"
    parts = (entry for entry in ast.walk(node) if isinstance(entry, ast.FunctionDef | ast.ClassDef))
    texts = [ast.get_docstring(entry) or "" for entry in parts]
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT and node.lineno <= token.start[0] <= node.end_lineno:
            texts.append(token.string.lstrip("# "))
    return " ".join(texts)


def text_of(file: str, name: str | None) -> str:
    """What is told in a file about one of its names; all of a file that is not Python's."""
    source = path_of(file).read_text(encoding="utf-8")
    if file.endswith(".py"):
        assert name is not None, f"{file}: which function?"
        return prose(source, name)
    assert name is None or f"_{name}(" in source, f"{name} is not there"
    return source


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


def test_numbers_are_read():
    assert named("(Eq. 12)") == {"12"}
    assert named("Eqs. 11, 12 and 14 (A5)") == {"11", "12", "14", "A5"}
    assert named("Eqs. 36 to\n    39; Eqs. 5-7") == {"36", "37", "38", "39", "5", "6", "7"}
    assert named("Eqs. A1 to A3, 17, 19 of 4 links") == {"A1", "A2", "A3", "17", "19"}
    assert named("omega_j (A1), v (A11, A12), Sect. 3, 4 and 5") == {"A1", "A11", "A12"}


def test_each_equation_has_one_row_in_order():
    assert [number for number, _ in ROWS] == EQUATIONS


def test_rows_are_true():
    for number, where in ROWS:
        with row(number):
            assert places(where)
            for file, name in places(where):
                assert number in named(text_of(file, name)), (file, name)

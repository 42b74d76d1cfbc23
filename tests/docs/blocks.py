"""The fenced blocks of a document, and what the words behind their language say.

- ```` ```python ````: it runs, after the blocks above it on the page.
- ```` ```c fall.c ````: its text is the file ``fall.c``, which blocks below it use.
- ```` ```sh not-run: it needs a cluster ````: nobody runs it here, for a reason.
"""

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
ABOVE = ("README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md")
PAGES = {Path(name).stem: ROOT / name for name in ABOVE}
PAGES |= {
    path.relative_to(ROOT / "docs").as_posix().removesuffix(".md"): path
    for path in sorted((ROOT / "docs").rglob("*.md"))
}
RUN = ("python", "sh", "toml", "c", "cpp", "cmake")  # languages whose blocks do something here
SHOWN = ("text", "json", "html")  # output, formulas
DIRECTIVE = re.compile(r"\{[\w-]+\}")  # of the site: a list of pages, an included document
FENCE = re.compile(r"^```([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NOT_RUN = "not-run:"


@dataclass(frozen=True)
class Block:
    """A fenced block; name: of the file that it is; reason: why it is not run."""

    page: Path
    line: int
    language: str
    text: str
    name: str = ""
    reason: str = ""

    def __str__(self) -> str:
        return f"{self.page.name}, line {self.line}"


def blocks(page: Path) -> list[Block]:
    """Return the blocks of a document in order, those of the site left out."""
    document = page.read_text(encoding="utf-8")
    found = []
    for fence in FENCE.finditer(document):
        language, _, words = fence[1].partition(" ")
        if DIRECTIVE.match(language):
            continue
        line = document.count("\n", 0, fence.start()) + 1
        said = {"reason": words.removeprefix(NOT_RUN).strip()} if NOT_RUN in words else {}
        said = said or {"name": words.strip()}
        found.append(Block(page, line, language, fence[2], **said))
    return found

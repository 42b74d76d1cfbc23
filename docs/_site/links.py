"""Links between pages that lead somewhere both in a checkout and on the site.

Documents are written for readers of the repository: ``docs/theory.md`` links to ``../README.md``
and ``../viewer``, and ``CONTRIBUTING.md``, which the site includes, links to ``docs/theory.md``.
"""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
REPOSITORY = "https://github.com/serpentail/serpentail"
PAGES = {
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "README.md": "index.md",
    "SECURITY.md": "security.md",
    "examples/gallery": "gallery/index.rst",
}
LINK = re.compile(r"\]\((?![a-z]+:|#)([^)\s#]+)(#[^)\s]*)?\)")


def links_of_page(app, name: str, source: list[str]) -> None:
    """Change the links of a page in docs/ that lead out of it."""
    del app
    up = "../" * name.count("/")
    source[0] = LINK.sub(lambda link: f"]({_from_page(link[1], up)}{link[2] or ''})", source[0])


def links_of_root(app, path: Path, parent: str, source: list[str]) -> None:
    """Change the links of a document of the root that a page includes."""
    del app, path, parent
    source[0] = LINK.sub(lambda link: f"]({_from_root(link[1])}{link[2] or ''})", source[0])


def _from_page(target: str, up: str) -> str:
    """Return where a link leads on the site; up: from the page's folder to docs/."""
    if not target.startswith(f"../{up}"):
        return target
    found = _from_root(target.removeprefix(f"../{up}"))
    return found if found.startswith("https:") else f"{up}{found}"


def _from_root(target: str) -> str:
    """Return where a link of the root leads, seen from docs/."""
    if target in PAGES:
        return PAGES[target]
    if target.startswith("examples/gallery/plot_"):
        return f"gallery/{Path(target).stem}.rst"
    if target.startswith("docs/"):
        return target.removeprefix("docs/")
    if (ROOT / target).is_dir():  # a page can offer a file for download, but no folder
        return f"{REPOSITORY}/tree/main/{target}"
    return f"../{target}"

"""What a wheel must have, and what it must not."""

import re
import zipfile
from collections.abc import Iterator
from email import message_from_bytes
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = "serpentail/viewer/page.html"
PARTS = {  # where the sources of a wheel's folders are, and which files of them it has
    "serpentail_codegen": (ROOT / "codegen" / "serpentail_codegen", ("*.py", "*.jinja", "*.typed")),
    "serpentail": (ROOT / "runtime" / "serpentail", ("*.py", "*.[ch]", "*.cc", "*.typed")),
    "serpentail/examples": (ROOT / "scenes", ("*.toml",)),
}
LICENCES = ("MIT License", "three.js authors", "Leon Sorokin")  # ours, and of the page's libraries


def faults(wheel: Path, page: bool) -> list[str]:
    """Return what is wrong with a wheel, a line each; page: whether it should have the page."""
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        (metadata,) = (name for name in names if name.endswith(".dist-info/METADATA"))
        text = message_from_bytes(archive.read(metadata)).get_payload()
        licences = [archive.read(name).decode() for name in names if name.endswith("/LICENSE")]
        licences += [archive.read(PAGE).decode()] if PAGE in names else []
    wanted = {*_sources(), *([PAGE] if page else [])}
    told = [f"lacks {name}" for name in sorted(wanted - names)]
    told += [f"has {name}" for name in sorted(names - wanted) if not _harmless(name)]
    told += [f"its text has a relative link: {link}" for link in relative_links(text)]
    of_wheel = LICENCES if page else LICENCES[:1]
    return told + [f"lacks a licence: {x}" for x in of_wheel if x not in "".join(licences)]


def _sources() -> Iterator[str]:
    """Yield the names in the wheel of all that comes from sources."""
    for place, (folder, patterns) in PARTS.items():
        for pattern in patterns:
            for path in folder.rglob(pattern):
                yield f"{place}/{path.relative_to(folder).as_posix()}"


def _harmless(name: str) -> bool:
    """Tell whether a file is the package's business though no source of its own."""
    return name == PAGE or re.match(r"serpentail-[^/]*\.dist-info/", name) is not None


def relative_links(text: str) -> list[str]:
    """Return the targets of pictures and links that lead nowhere outside a checkout."""
    return [target for target in re.findall(r"\]\(([^)\s]+)\)", text) if "://" not in target]

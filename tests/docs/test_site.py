"""The site: whole, without a warning, and complete in itself."""

import inspect
import re
import shutil
import subprocess
import sys
from html import unescape
from urllib.parse import unquote

import pytest

import serpentail as st
from tests.docs.running import ROOT
from tests.support.rows import row

CLASSES = (st.Model, st.Trajectory, st.Plan, st.Rollouts, st.Mpc, st.Sweep, st.Identification)
LINK = r'<link\b(?=[^>]*\srel="([^"]*)")[^>]*\shref="([^"]*)"'
RELATED = {"next", "prev", "search", "index"}
BESIDE = ("CHANGELOG.md", "CONTRIBUTING.md", "LICENSE", "README.md", "SECURITY.md")
BESIDE += ("examples", "hatch_build.py", "scenes", "tests", "viewer")  # what pages link to


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, built as `make docs` does, but without running the scripts of the gallery."""
    pytest.importorskip("sphinx")
    tree = tmp_path_factory.mktemp("site")
    made = shutil.ignore_patterns("api", "gallery", "__pycache__")
    shutil.copytree(ROOT / "docs", tree / "docs", ignore=made)
    for name in BESIDE:
        (tree / name).symlink_to(ROOT / name)
    options = ["-W", "--keep-going", "-n", "-q", "-D", "plot_gallery=False"]
    command = [sys.executable, "-m", "sphinx", *options, "docs", "html"]
    done = subprocess.run(command, cwd=tree, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return tree / "html"


def parts(page):
    """What a page fetches, where it leads, and the anchors that it has."""
    text = unescape(page.read_text(encoding="utf-8"))
    fetched = re.findall(r'<(?:script|img|iframe|source|video)\b[^>]*\ssrc="([^"]*)"', text)
    fetched += [href for rel, href in re.findall(LINK, text) if rel not in RELATED]
    links = re.findall(r'<a\b[^>]*\shref="([^"]*)"', text)
    return fetched, links, set(re.findall(r'\sid="([^"]*)"', text))


def of_class(member) -> bool:
    """Tell whether a member is a method or a property; fields are explained by their class."""
    return inspect.isfunction(member) or inspect.ismethod(member) or isinstance(member, property)


@pytest.mark.slow
def test_the_site_has_every_name_fetches_nothing_from_elsewhere_and_leads_somewhere(site):
    from sphinx.util.inventory import InventoryFile

    with (site / "objects.inv").open("rb") as file:
        known = InventoryFile.load(file, "", lambda base, name: name)
    names = {name for kind in known for name in known[kind] if kind.startswith("py:")}
    wanted = {f"serpentail.{name}" for name in st.__all__}
    for each in CLASSES:
        members = inspect.getmembers(each, of_class)
        wanted |= {f"serpentail.{each.__name__}.{name}" for name, _ in members if name[0] != "_"}
    assert wanted - names == set()
    pages = {path: parts(path) for path in site.rglob("*.html")}
    for path, (fetched, links, _) in pages.items():
        with row(path):
            assert fetched and links
            assert [x for x in fetched if "//" in x.split("?")[0] or x.startswith("/")] == []
            for target in filter(None, [*links, *fetched]):
                place, _, anchor = target.partition("#")
                other = (path.parent / unquote(place.split("?")[0])).resolve() if place else path
                assert re.match(r"[a-z]+:", target) or other.exists(), target
                if anchor and other in pages:
                    assert unquote(anchor) in pages[other][2], target
    for sheet in site.rglob("*.css"):
        text = sheet.read_text(encoding="utf-8")
        assert re.findall(r"@import[^;]*//|url\([\"']?(?:https?:)?//", text) == [], sheet

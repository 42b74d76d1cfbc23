"""Every block of every document runs as pasted, or says why it does not; the site is whole, without
a warning, and complete in itself.
"""

import ast
import doctest
import inspect
import re
import shutil
import subprocess
import sys
import tomllib
from html import unescape
from urllib.parse import unquote

import numpy as np
import pytest

import serpentail as st
from tests.docs.running import PAGES, ROOT, blocks, run_page
from tests.support.rows import row

RUN = ("python", "sh", "toml", "c", "cpp", "cmake")  # languages whose blocks do something here
SHOWN = ("text", "json", "html")  # output, formulas
QUICK = {"autodiff", "contact", "continuum_forms", "learning", "python"}
NEEDS = {"autodiff": ["jax"], "export": ["pinocchio"], "viewing": ["imageio_ffmpeg", "viser"]}
NEEDS |= {"recipes": ["fmpy"]}
RUNNING = [
    pytest.param(name, marks=[] if name in QUICK else [pytest.mark.slow])
    for name, path in PAGES.items()
    if any(block.language in RUN and not block.reason for block in blocks(path))
]


def test_every_block_says_what_it_is_or_why_it_is_not_run():
    for block in (block for path in PAGES.values() for block in blocks(path)):
        with row(block):
            assert block.language in (*RUN, *SHOWN) or block.reason
            assert block.language not in ("c", "cpp") or block.name or block.reason
            assert not block.reason or len(block.reason.split()) > 2
            if block.reason and block.language == "python":
                ast.parse(block.text)
            elif block.reason and block.language == "toml":
                tomllib.loads(block.text)


@pytest.mark.parametrize("name", RUNNING)
def test_the_blocks_of_a_page_run(name, tmp_path):
    for library in NEEDS.get(name, []):
        pytest.importorskip(library)
    printed = run_page(PAGES[name], tmp_path)
    if name in ("README", "c"):  # their C is what the model is
        model = st.load(tmp_path / "generated" / "articulated_m3_n4")
        q = np.array([0, 0, 0, 1, 0, 0, 0, 0.5, 0, 0, 0, 0, 0])
        v_dot = model.forward_dynamics(q, np.zeros(model.nv), np.array([1e-3, 0, 0, 0, 0, 0]))
        line = f"status 0, p_ddot_z = {v_dot[2]:g} m/s^2, alpha_1_ddot = {v_dot[6]:g} rad/s^2\n"
        assert printed.count(line) == 2  # by the page's command, and without warnings


def test_examples_of_docstrings_run():
    found, finder = [], doctest.DocTestFinder(recurse=False)
    for name in st.__all__:
        thing = getattr(st, name)
        members = [n for n in dir(thing) if n[0] != "_"] if inspect.isclass(thing) else []
        for each in [thing, *(inspect.getattr_static(thing, n) for n in members)]:
            if ">>>" in (inspect.getdoc(each) or ""):
                found += finder.find(getattr(each, "__func__", each), name, globs={})
    assert len(found) > 5
    for each in found:
        with row(each.name):
            assert doctest.DocTestRunner().run(each).failed == 0


# The site.

CLASSES = (st.Model, st.Trajectory, st.Plan, st.Rollouts, st.Gains, st.Mpc, st.Sweep)
CLASSES += (st.Identification,)
LINK = r'<link\b(?=[^>]*\srel="([^"]*)")[^>]*\shref="([^"]*)"'
RELATED = {"next", "prev", "search", "index"}
BESIDE = ("CHANGELOG.md", "CONTRIBUTING.md", "LICENSE", "README.md", "SECURITY.md")
BESIDE += ("examples", "hatch_build.py", "scenes", "tests", "viewer")  # what pages link to


def made_site(tree):
    """The site, built as `make docs` does, but without running the scripts of the gallery."""
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
def test_the_site_has_every_name_fetches_nothing_from_elsewhere_and_leads_somewhere(tmp_path):
    inventory = pytest.importorskip("sphinx.util.inventory").InventoryFile
    site = made_site(tmp_path)
    with (site / "objects.inv").open("rb") as file:
        known = inventory.load(file, "", lambda base, name: name)
    names = {name for kind in known for name in known[kind] if kind.startswith("py:")}
    wanted = {f"serpentail.{name}" for name in st.__all__}
    for each in CLASSES:
        members = inspect.getmembers(each, of_class)
        wanted |= {f"serpentail.{each.__name__}.{name}" for name, _ in members if name[0] != "_"}
    assert wanted - names == set()
    # a page of motions, which a frame shows, leads nowhere
    shown = [path for path in site.rglob("*.html") if path.name != "rat.html"]
    pages = {path: parts(path) for path in shown}
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

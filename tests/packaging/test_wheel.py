"""The wheel has all that runs, and nothing else; its description can be read anywhere."""

import shutil
import subprocess
import sys
import zipfile

import pytest
from hatchling.metadata.core import ProjectMetadata
from hatchling.plugin.manager import PluginManager

from tests.packaging.contents import PAGE, ROOT, faults, relative_links


@pytest.fixture(scope="module")
def metadata():
    """What is published of the project besides its files."""
    return ProjectMetadata(str(ROOT), PluginManager()).core


def test_pictures_and_links_of_the_description_lead_somewhere(metadata):
    own = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "](docs/images/" in own  # which a checkout shows without a network
    assert relative_links(metadata.readme) == []
    assert metadata.readme.count("](") == own.count("](")
    assert "main/docs/images/filmstrip.png)" in metadata.readme


def test_who_finds_the_package_learns_what_it_is(metadata):
    assert set(metadata.urls) == {"Homepage", "Documentation", "Source", "Changelog"}
    assert all(url.startswith("https://") for url in metadata.urls.values())
    assert metadata.authors and metadata.keywords and "Typing :: Typed" in metadata.classifiers
    versions = {c.rpartition(" ")[2] for c in metadata.classifiers if "Python :: 3." in c}
    assert versions == {"3.11", "3.12", "3.13"}


@pytest.mark.slow
def test_the_wheel_of_the_sdist_is_whole(tmp_path):
    command = ["build", "--no-isolation", "--skip-dependency-check", "--outdir", tmp_path, ROOT]
    done = subprocess.run([sys.executable, "-m", *command], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    (wheel,) = tmp_path.glob("*.whl")
    assert faults(wheel, page=shutil.which("npm") is not None) == []


def test_what_a_wheel_lacks_or_has_too_much_is_told(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.whl", "w") as archive:
        archive.writestr("serpentail-1.dist-info/METADATA", "Name: a\n\n![x](docs/x.png)")
        archive.writestr("tests/test_all.py", "")
    told = faults(tmp_path / "a.whl", page=True)
    expected = [f"lacks {PAGE}", "lacks serpentail/py.typed", "lacks serpentail/examples/kick.toml"]
    expected += ["has tests/test_all.py", "its text has a relative link: docs/x.png"]
    assert {*expected, "lacks a licence: MIT License"} <= set(told)

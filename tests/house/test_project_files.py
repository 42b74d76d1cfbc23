"""The files about the project itself: changelog, release notes, citation, workflow."""

import re
from pathlib import Path

import jsonschema
import pytest
import yaml  # PyYAML comes with Dask, an extra of developers
from hatchling.builders.sdist import SdistBuilder

import serpentail as st

ROOT = Path(__file__).parents[2]
GROUPS = ["Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"]

# What the Citation File Format 1.2.0 demands of the keys that our file has.
TEXT = {"type": "string", "minLength": 1}
ENTITY = {
    "type": "object",
    "properties": {"name": TEXT},
    "required": ["name"],
    "additionalProperties": False,
}
PERSON = {
    "type": "object",
    "properties": {"family-names": TEXT, "given-names": TEXT},
    "additionalProperties": False,
}
AUTHORS = {"type": "array", "minItems": 1, "items": {"anyOf": [ENTITY, PERSON]}}
DATE = {"type": "string", "pattern": r"^\d{4}-(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01])$"}
REFERENCE = {
    "type": "object",
    "properties": {
        "type": {"enum": ["article", "book", "software", "thesis"]},
        "title": TEXT,
        "authors": AUTHORS,
        "journal": TEXT,
        "year": {"type": "integer"},
        "doi": {
            "type": "string",
            "pattern": r"^10\.\d{4,9}/\S+$",
        },
    },
    "required": ["type", "title", "authors"],
    "additionalProperties": False,
}
CITATION = {
    "type": "object",
    "properties": {
        "cff-version": {"const": "1.2.0"},
        "message": TEXT,
        "type": {"enum": ["software", "dataset"]},
        "title": TEXT,
        "abstract": TEXT,
        "authors": AUTHORS,
        "version": TEXT,
        "date-released": DATE,
        "license": {"const": "MIT"},
        "repository-code": {"type": "string", "pattern": r"^https://"},
        "keywords": {"type": "array", "minItems": 1, "uniqueItems": True, "items": TEXT},
        "references": {"type": "array", "minItems": 1, "items": REFERENCE},
    },
    "required": ["cff-version", "message", "title", "authors"],
    "additionalProperties": False,
}


def loaded(name):
    """The data of a YAML file of the checkout."""
    return yaml.safe_load((ROOT / name).read_text(encoding="utf-8"))


def releases(changelog):
    """The sections of a changelog by version: (date or None, groups, text)."""
    found = {}
    for section in re.split(r"^## ", changelog, flags=re.MULTILINE)[1:]:
        head, _, text = section.partition("\n")
        version, date = re.fullmatch(r"\[(\S+)\](?: - (\S+))?", head).groups()
        assert version not in found
        found[version] = (date, re.findall(r"^### (.*)$", text, re.MULTILINE), text)
    return found


# Changelog and release notes


def test_changelog_has_the_headings_of_its_format():
    sections = releases((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"))
    assert next(iter(sections)) == "Unreleased"
    for version, (date, groups, _) in sections.items():
        assert (date is None) == (version == "Unreleased")
        assert groups == [group for group in GROUPS if group in groups]  # each once, in this order


def test_newest_release_is_the_version_of_the_package():
    sections = releases((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"))
    newest = list(sections)[1]
    date, _, text = sections[newest]
    citation = loaded("CITATION.cff")
    assert newest == st.__version__ == citation["version"]
    assert date == citation["date-released"]
    notes = f"docs/release_notes/{newest}.md"
    assert f"({notes})" in text and (ROOT / notes).exists()


def test_changelog_links_to_no_tag():
    """A tag is made after the release is merged: until then its pages do not exist."""
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert not re.findall(r"https://\S+/(?:compare|releases)/", text)


# Citation


def test_citation_is_valid():
    jsonschema.validate(loaded("CITATION.cff"), CITATION)


@pytest.mark.parametrize("key", ["cff-version", "message", "title", "authors"])
def test_citation_without_a_key_is_refused(key):
    citation = loaded("CITATION.cff")
    del citation[key]
    with pytest.raises(jsonschema.ValidationError, match=key):
        jsonschema.validate(citation, CITATION)


def test_citation_names_the_paper_of_the_readme():
    (paper,) = loaded("CITATION.cff")["references"]
    assert paper["doi"] in (ROOT / "README.md").read_text(encoding="utf-8")


def test_sdist_has_the_citation():
    files = {file.distribution_path for file in SdistBuilder(str(ROOT)).recurse_included_files()}
    assert {"CITATION.cff", "CHANGELOG.md", f"docs/release_notes/{st.__version__}.md"} <= files


# Workflow


def test_workflow_runs_every_check_with_few_rights():
    workflow = loaded(".github/workflows/ci.yml")
    triggers = workflow[True]  # YAML 1.1 reads the key "on" as a truth
    assert set(triggers) == {"push", "pull_request"}
    assert workflow["permissions"] == {"contents": "read"}
    assert workflow["concurrency"]["cancel-in-progress"] is True
    (job,) = workflow["jobs"].values()
    assert job["runs-on"].startswith("ubuntu-") and job["timeout-minutes"] == 90
    assert job["container"]["image"].startswith("python:3.11-")
    assert job["steps"][-1]["run"] == ".ci/run"


def test_what_the_workflow_calls_can_be_run():
    assert (ROOT / ".ci" / "run").stat().st_mode & 0o111

"""Docstrings of public names: sections that agree with signatures, and examples that run."""

import doctest
import inspect
import re

import pytest

import serpentail as st
from serpentail.model.model import Model
from serpentail_codegen.scene.signatures.table import SIGNATURES

SECTIONS = ("Parameters", "Other Parameters", "Attributes", "Returns", "Raises")
OTHER_NAMES = {"crba", "nle", "rnea", "aba"}  # whose docstrings are those of the usual names
# sizes of the table of signatures, as docstrings spell them
SIZES = {
    "nt": "2m",
    "tail_points": "N + 1",
    "loads": "6 + 3 (N + 1)",
    "points": "K",
    "bristles": "2K",
    "leg_numbers": "8",
    "parameter_numbers": "parameters",
    "airborne_state": "4 + 4m",
    "airborne_results": "7 + 4m",
    "airborne_arguments": "4 + 6m",
}


def documented(text, section):
    """Entries of a section: names, and what stands behind the colon."""
    lines = inspect.cleandoc(text).splitlines()
    found = {}
    for k, line in enumerate(lines[:-1]):
        if line != section or set(lines[k + 1]) != {"-"}:
            continue
        for entry in lines[k + 2 :]:
            if entry in SECTIONS or set(entry) == {"-"} or entry in ("Notes", "Examples"):
                break
            if entry and not entry.startswith(" "):
                names, _, kind = entry.partition(" : ")
                found |= dict.fromkeys(names.lstrip("*").replace("*", "").split(", "), kind)
    return found


def public():
    """Name and object of each public function and class, and of their public methods."""
    for name in st.__all__:
        thing = getattr(st, name)
        yield name, thing
        if not inspect.isclass(thing) or issubclass(thing, Exception):
            continue
        for each in dir(thing):
            value = inspect.getattr_static(thing, each)
            value = getattr(value, "__func__", value)
            home = getattr(inspect.getmodule(value), "__name__", "")
            if not each.startswith("_") and inspect.isfunction(value) and "serpentail" in home:
                yield f"{name}.{each}", value


# what other parts of the package call, which no user needs
INSIDE = re.compile(
    r"\.(parts|later|kinks|of_run|mapped|refuse_fixed|without|tail_words|stop_at|legs|stops|begin"
    r"|described|markdown)$"
)
PUBLIC = {name: thing for name, thing in public() if not INSIDE.search(name)}
CALLABLE = {
    name: thing
    for name, thing in PUBLIC.items()
    if not (inspect.isclass(thing) and issubclass(thing, Exception)) and name != "Model"
}


@pytest.mark.parametrize("name", CALLABLE)
def test_each_argument_is_described_and_nothing_else(name):
    thing = CALLABLE[name]
    text = inspect.getdoc(thing)
    described = {}
    for section in SECTIONS[:3]:
        described |= documented(text, section)
    parameters = inspect.signature(thing).parameters.values()
    named = {each.name for each in parameters if each.kind != each.VAR_KEYWORD}
    named -= {"self", "cls", "unknown", "source"} if inspect.isclass(thing) else {"self", "cls"}
    assert not named - described.keys(), "described nowhere"
    takes_more = any(each.kind == each.VAR_KEYWORD for each in parameters)
    if not takes_more and not inspect.isclass(thing):
        assert not described.keys() - named, "no such argument"


@pytest.mark.parametrize("name", [name for name in CALLABLE if not inspect.isclass(PUBLIC[name])])
def test_what_is_returned_is_described(name):
    thing = CALLABLE[name]
    if thing.__annotations__.get("return") in (None, "None") or name == "progress":
        return
    assert documented(inspect.getdoc(thing), "Returns")


METHODS = {name: each for name, each in SIGNATURES.items() if each.outputs and hasattr(Model, name)}


def shape(argument):
    """The shape of an argument of the table, as docstrings spell it."""
    sizes = [SIZES.get(size, str(size)) for size in argument.sizes]
    return f"({sizes[0]},)" if len(sizes) == 1 else f"({', '.join(sizes)})"


def test_the_table_of_signatures_has_methods():
    assert len(METHODS) > 25


@pytest.mark.parametrize("name", METHODS)
def test_methods_are_described_as_the_table_of_signatures_has_them(name):
    signature, text = METHODS[name], inspect.getdoc(getattr(Model, name))
    arguments, results = documented(text, "Parameters"), documented(text, "Returns")
    arguments.pop("f_ext", None)  # of another function of the table
    assert [*arguments] == [each.name for each in signature.inputs]
    assert [*results] == [each.name for each in signature.outputs]
    for each in (*signature.inputs, *signature.outputs):
        kind = (arguments | results)[each.name]
        assert shape(each) in kind or (kind, each.sizes) == ("float", (1,)), each.name


@pytest.mark.parametrize("name", [name for name in PUBLIC if ">>>" in inspect.getdoc(PUBLIC[name])])
def test_examples_run(name):
    finder = doctest.DocTestFinder(recurse=False)
    for each in finder.find(PUBLIC[name], name, globs={}):
        assert doctest.DocTestRunner().run(each).failed == 0

"""The C text: it compiles without a warning, keeps to itself, and is no longer than needed."""

import re
from itertools import product

import pytest

from serpentail_scene.signatures.table import DERIVATIVES
from tests.support import zoo
from tests.support.models import folder_of, model_folder
from tests.support.rows import row
from tests.support.toolchains import clang

from .emitted import C99, NAMES, PLAIN, STRICT, Model, compiled, model_of, run, symbols

QUICK = ("small", "segments", "arcs1")
every_model = pytest.mark.parametrize(
    "models",
    [QUICK, pytest.param([n for n in zoo.ZOO if n not in QUICK], marks=pytest.mark.slow)],
    ids=["quick", "others"],
)


# Warnings


@every_model
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_compiles_without_a_warning(tmp_path, compiler, models):
    if compiler == "clang":
        clang()
    for model in map(model_of, models):
        for source in (*model.sources, model.example):
            flags = (*C99, "-fsyntax-only")
            compiled(tmp_path, source, *flags, compiler=compiler)


@pytest.mark.parametrize(
    "functions", [["center_of_mass"], pytest.param(NAMES, marks=pytest.mark.slow)]
)
def test_every_function_alone_compiles_without_a_warning(tmp_path, functions):
    """Models of one function each: nothing is unused where others are missing."""
    forms = list(product(["straight", "loops"], [False, True]))
    for k, function in enumerate(functions):
        for emission, baked in forms if len(functions) == 1 else (forms[1], forms[k % 4]):
            options = {"functions": [function], "emission": emission, "baked": baked}
            model = Model(model_folder(2, 2, name="alone", **options))
            for source in (*model.sources, model.example):
                with row(function, emission, baked):
                    compiled(tmp_path, source, *C99, "-fsyntax-only")


def test_header_is_cpp_and_models_link_into_one_program(tmp_path):
    """In C++11, headers twice; the program calls each model that it links."""
    main, calls, includes, objects, folders = tmp_path / "main.cpp", "", "", [], []
    for name in ("bare", "small"):
        model, upper = model_of(name), name.upper()
        includes += 2 * f'#include "{name}.h"\n'
        calls += f"""  {{
    static {name}_real q[{upper}_NQ], v[{upper}_NV], tau[{upper}_NT], v_dot[{upper}_NV];
    static {name}_real work[{upper}_WORK_FORWARD_DYNAMICS + 1];
    {name}_parameters p;
    {name}_default_parameters(&p);
    q[3] = 1;
    bad += {name}_forward_dynamics(&p, q, v, tau, v_dot, work) != {upper}_OK;
    bad += !(v_dot[2] < -9 && v_dot[2] > -10);
  }}
"""
        objects += model.objects.values()
        folders += ["-I", model.include]
    main.write_text(
        f"{includes}#include <cmath>\nint main() {{\n  int bad = 0;\n{calls}  return bad;\n}}\n"
    )
    flags = ("-std=c++11", "-no-pie", *STRICT, *folders)
    run("g++", *flags, main, *objects, "-o", tmp_path / "main", "-lm")
    run(tmp_path / "main")
    for model in map(model_of, ("bare", "small", "polar")):  # the source is C++, too
        flags = ("-std=c++11", "-Wall", "-Wextra", "-Werror", "-fsyntax-only")
        with row(model.name):
            run("g++", "-x", "c++", *flags, "-I", model.include, model.source)


# Symbols

MEMORY = {"memcpy", "memmove", "memset"}  # what compilers make of loops


def assert_own_symbols(model, objects, *merged):
    """A model defines what its header declares, and wants no more than the mathematics and memory
    of libc; no .data, no .bss, no common: every object with static storage is constant.
    """
    suffix = "f" if model.manifest["real"] == "float" else ""
    defined = {
        part: {symbol for _, symbol in symbols(path, "-g", "--defined-only")}
        for part, path in objects.items()
    }
    every = set().union(*defined.values())
    wanted = {symbol for path in objects.values() for _, symbol in symbols(path, "-u")} - every
    mathematics = ("sin", "cos", "sqrt", "pow", "ceil", *merged)
    assert wanted <= {f"{name}{suffix}" for name in mathematics} | MEMORY
    kinds = {kind for path in objects.values() for kind, _ in symbols(path)}
    assert {"T", "U"} <= kinds <= set("TtrRU")

    headers = {"": (model.name, f"{model.name}_unchecked")}
    headers["_simulation"] = (f"{model.name}_simulation",)
    for part, names in headers.items():
        if part in objects:
            text = "".join((model.include / f"{name}.h").read_text() for name in names)
            assert defined.pop(part) == set(re.findall(r"^(?:int|void) (\w+)\(", text, re.M))
    host = f"{model.name}_(batch_|abi_hash$)|(jac_|adj1_|jac_adj1_)?{model.name}_casadi_"
    assert all(re.match(host, symbol) for symbol in defined.pop("_host"))
    for part, found in defined.items():
        beside = f"{model.name}_side_by_side_"
        assert found and all(symbol.startswith(beside) for symbol in found), part
    ways = {f"{model.name}_side_by_side_{way}" for way in ("rollouts", "steps")}
    assert defined.get("_flights", ways) == ways


@pytest.mark.parametrize(
    "models",
    [
        ("m1_n1", "small"),
        pytest.param(("segments", "arcs1", "ground_m1_n1"), marks=pytest.mark.slow),
    ],
    ids=["quick", "others"],
)
def test_every_symbol_has_the_prefix_and_libc_gives_the_rest(models):
    for model in map(model_of, models):
        with row(model.name):
            assert_own_symbols(model, model.objects)


@pytest.mark.parametrize(
    "name", ["bare", *(pytest.param(n, marks=pytest.mark.slow) for n in ("small", "m1_n1"))]
)
def test_optimiser_warns_about_nothing_and_asks_for_no_more_than_sincos(tmp_path, name):
    model, objects = model_of(name), {}
    for source in model.sources:
        flags = (*C99, *PLAIN, "-O2")
        objects[source.stem.removeprefix(name)] = compiled(tmp_path, source, *flags)
    assert_own_symbols(model, objects, "sincos")


# Numbers, lines and sizes

NUMBER = r"(?<![\w.])\d+(?:\.\d+(?:[eE][-+]?\d+)?|[eE][-+]?\d+)f?"


@every_model
def test_numbers_are_shortest_decimals_of_the_right_type_and_lines_are_clean(models):
    for model in map(model_of, models):
        suffix, texts = "f" if model.scene.real == "float" else "", {}
        for path in (*model.sources, *model.include.glob("*.h"), model.example):
            texts[path] = path.read_text()
            with row(path.name):
                assert texts[path].isascii() and re.search(r"[^\n]\n\Z", texts[path])
                assert not re.search(r"[ \t]+$", texts[path], re.M)
        code = "".join(texts[path] for path in model.sources if "batch" not in path.name)
        code = re.sub(r"/\*.*?\*/|\"[^\"\n]*\"", "", code, flags=re.S)
        literals = set(re.findall(NUMBER, code))
        with row(model.name):
            assert len(literals) > 10
            assert {t for t in literals if t.endswith("f") != bool(suffix)} == set()
            shortest = {t: repr(float(t.rstrip("f"))) + suffix for t in literals}
            assert {t for t, short in shortest.items() if len(t) > len(short)} == set()


def test_text_of_a_long_tail_is_bounded():
    """Under 102 kB for all functions of values, 45 kB more for the Jacobians of forward dynamics;
    sizes are the point.
    """
    values = [name for name in NAMES if name not in DERIVATIVES]

    def size(segments, links, functions):
        options = {"name": "tail", "emission": "loops", "functions": functions}
        return Model(model_folder(segments, links, **options)).source.stat().st_size

    assert size(8, 16, values) < 102_000
    assert size(8, 16, NAMES) < size(8, 16, values) + 45_000
    assert size(8, 16, NAMES) < 1.02 * size(3, 4, NAMES)


def test_automatic_form_is_straight_until_the_code_grows_large():
    """Sizes are the point: of the forms of one function."""
    sizes = {(1, 1): "straight", (2, 15): "lanes", (2, 16): "segments", (8, 16): "segments"}
    forms = {}
    for segments, links in sizes:
        scene = zoo.scene("bare", segments=segments, links=links)
        manifest = Model(folder_of(scene)).manifest
        forms[segments, links] = manifest["functions"]["forward_dynamics"]["emission"]
    assert forms == sizes
    # what is only sometimes run is not written out
    touching = model_of("ground_m1_n1").manifest["functions"]
    assert touching["implicit_solve"]["emission"] == "loops"
    assert touching["forward_dynamics"]["emission"] == "straight"
    asked = model_of("small").manifest["functions"]
    assert asked["forward_dynamics"]["emission"] == "loops"

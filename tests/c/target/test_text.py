"""The C text: it compiles without a warning, means what its program means bit for bit, and keeps to
itself.
"""

import re
import shlex
import shutil
from itertools import product

import numpy as np
import pytest

from serpentail_codegen.ir.interpret import Numbers

from ...support.toolchains import clang
from .emitted import (
    C99,
    NAMES,
    PLAIN,
    STRICT,
    Model,
    compiled,
    every_model,
    interpreted,
    run,
    slow_but,
    symbols,
)

some_models = pytest.mark.parametrize(
    "name", ["m1_n1_double_straight", "m1_n1_float_loops", "m1_n1_baked_straight"]
)


# Warnings.


@every_model
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_compiles_without_a_warning(models, tmp_path, compiler, name):
    model = models(name)
    if compiler == "clang":
        clang()
    for source in (*model.sources, model.example):
        compiled(tmp_path, source, *C99, "-fsyntax-only", compiler=compiler)


@pytest.mark.parametrize(
    "name",
    [
        "m1_n1_double_straight",
        pytest.param("m2_n2_double_loops", marks=pytest.mark.slow),
        pytest.param("m2_n2_float_straight", marks=pytest.mark.slow),
    ],
)
def test_optimiser_finds_nothing_to_warn_about(models, tmp_path, name):
    for source in (
        models(name).source,
        models(name).batch,
        models(name).simulation,
        models(name).flights,
    ):
        compiled(tmp_path, source, *C99, "-O2")


def alone():
    """Every function, baked or not, in every form: of most functions one case is quick."""
    for case in product(NAMES, ["straight", "loops"], ["free", "baked"]):
        quick = case[0] == "forward_dynamics" or case[1:] == ("loops", "free")
        yield pytest.param(*case, marks=() if quick else pytest.mark.slow)


@pytest.mark.parametrize(("function", "emission", "baked"), list(alone()))
def test_every_function_alone_compiles_without_a_warning(tmp_path, function, emission, baked):
    model = Model("alone", 2, 2, functions=[function], emission=emission, baked=baked == "baked")
    for source in (*model.sources, model.example):
        compiled(tmp_path, source, *C99, "-fsyntax-only")


@some_models
def test_header_is_cpp_and_links_from_it(models, tmp_path, name):
    model, main = models(name), tmp_path / "main.cpp"
    real = f"{name}_real"
    inputs = "".join(
        f", x.{a['name']}" for a in model.manifest["functions"]["mass_matrix"]["inputs"]
    )
    main.write_text(
        f'#include "{name}.h"\n#include "{name}.h"\n#include <cmath>\n'
        "static struct "
        f"{{ {real} q[{name.upper()}_NQ], H[{name.upper()}_NV * {name.upper()}_NV]; }} x;\n"
        f"int main() {{\n  {name}_parameters p;\n  {name}_default_parameters(&p);\n  x.q[3] = 1;\n"
        f"  static {real} work[{name.upper()}_WORK_MASS_MATRIX + 1];\n"
        f"  return {name}_mass_matrix(&p{inputs}, x.H, work) != {name.upper()}_OK || !(x.H[0] > "
        "0);\n}\n"
    )
    run(
        "g++",
        "-std=c++11",
        "-no-pie",
        *STRICT,
        "-I",
        model.include,
        main,
        *model.objects,
        "-o",
        tmp_path / "main",
        "-lm",
    )
    run(tmp_path / "main")


# Symbols.


MEMORY = {"memcpy", "memset"}  # what compilers make of loops


def assert_own_symbols(model, objects, *merged):
    """A model defines what its header declares, and wants no more than the mathematics and memory
    of libc.
    """
    suffix = "f" if model.manifest["real"] == "float" else ""
    parts = [{symbol for _, symbol in symbols(path, "-g", "--defined-only")} for path in objects]
    own, host, batch, simulation, *flights = parts
    defined = set().union(*parts)
    wanted = {symbol for path in objects for _, symbol in symbols(path, "-u")} - defined
    assert (
        wanted
        <= {f"{name}{suffix}" for name in ("sin", "cos", "sqrt", "pow", "ceil", *merged)} | MEMORY
    )
    unchecked, header = (model.include / f"{model.name}_{k}.h" for k in ("unchecked", "simulation"))
    for found, paths in ((own, (model.header, unchecked)), (simulation, (header,))):
        text = "".join(path.read_text() for path in paths)
        assert found == set(re.findall(r"^(?:int|void) (\w+)\(", text, re.M))
    names = f"{model.name}_(batch_|abi_hash$)|(jac_|adj1_|jac_adj1_)?{model.name}_casadi_"
    assert all(re.match(names, symbol) for symbol in host)
    assert batch and all(symbol.startswith(f"{model.name}_side_by_side_") for symbol in batch)
    ways = {f"{model.name}_side_by_side_{way}" for way in ("flights", "rollouts", "steps")}
    assert all(found == ways for found in flights)


@every_model
def test_every_symbol_has_the_prefix_and_libc_gives_the_rest(models, name):
    assert_own_symbols(models(name), models(name).objects)


@slow_but("m1_n1_float_loops")
def test_optimiser_asks_for_no_more_than_sincos(models, tmp_path, name):
    model = models(name)
    objects = [compiled(tmp_path, source, *PLAIN, "-O2") for source in model.sources]
    assert_own_symbols(model, objects, "sincos")


@every_model
def test_nothing_is_kept_between_calls(models, name):
    """No .data, no .bss, no common: every object with static storage is constant."""
    kinds = {kind for path in models(name).objects for kind, _ in symbols(path)}
    assert {"T", "U"} <= kinds <= set("TtrRU")


def test_models_link_into_one_program(models, tmp_path):
    chosen = [
        models(name) for name in ("m1_n1_double_straight", "m2_n2_float_loops", "m2_n2_baked_loops")
    ]
    main, calls = tmp_path / "main.c", ""
    for m in chosen:
        calls += f"  {m.name}_parameters p_{m.name};\n  {m.name}_default_parameters(&p_{m.name});\n"
        calls += f"  sum += (double)p_{m.name}.gravity + {m.name.upper()}_NV;\n"
    includes = "".join(f'#include "{m.name}.h"\n' for m in chosen)
    main.write_text(
        f"{includes}#include <stdio.h>\nint "
        f'main(void)\n{{\n  double sum = 0.0;\n{calls}  printf("%g", sum);\n'
        "  return 0;\n}\n"
    )
    objects = [path for m in chosen for path in m.objects]
    folders = [word for m in chosen for word in ("-I", m.include)]
    run("gcc", *C99, "-no-pie", *folders, main, *objects, "-o", tmp_path / "main", "-lm")
    assert float(run(tmp_path / "main")) == pytest.approx(3 * 9.8 + 8 + 10 + 10, rel=1e-5)


@some_models
def test_example_builds_with_the_command_in_its_comment(models, tmp_path, name):
    model = models(name)
    folder = shutil.copytree(model.folder, tmp_path / "copy")
    command = re.search(r"Build: (cc .*) \*/", model.example.read_text()).group(1)
    run(*shlex.split(command), cwd=folder)
    printed = re.findall(r"v_dot\[(\d+)\] = (\S+)", run(folder / "a.out"))
    q = np.zeros(model.manifest["dimensions"]["nq"])
    v, tau = np.zeros_like(q[1:]), np.zeros_like(q[7:])
    q[3], q[7], v[3], tau[0] = 1, 0.5, 1, 1e-4
    v_dot = interpreted(model, "forward_dynamics", {"q": q, "v": v, "tau": tau}, Numbers())["v_dot"]
    assert [int(k) for k, _ in printed] == list(range(len(v_dot)))
    tolerance = 1e-3 if "float" in name else 1e-6
    np.testing.assert_allclose(
        [float(x) for _, x in printed], v_dot, rtol=tolerance, atol=tolerance
    )

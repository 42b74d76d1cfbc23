"""The C text: it compiles without a warning, means what its program means bit for bit, and keeps to
itself.
"""

import ctypes
import json
import platform
import re
import shlex
import shutil
import subprocess
from functools import cache, cached_property
from itertools import product
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest

from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.ir.step import Step
from serpentail_codegen.pipeline import tail_of
from serpentail_codegen.scene.parse import parse_scene
from serpentail_codegen.scene.signatures.table import ALL, DEFAULT, DERIVATIVES, VALUES
from serpentail_codegen.targets.c.form import in_form
from serpentail_codegen.targets.c.routine import Routine, routine_lines
from tests.references.parameters import random_states
from tests.support.compile_once import compile_once
from tests.support.models import model_folder

NAMES = tuple(name for name in ALL if name in (*DEFAULT, *VALUES))
STRICT = (
    "-pedantic",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wdouble-promotion",
    "-Wshadow",
    "-Werror",
)
C99 = ("-std=c99", *STRICT)
PLAIN = ("-std=c99", "-fno-stack-protector", "-fno-pic")
SANITIZED = (
    "-std=c99",
    "-g",
    "-O0",
    "-fsanitize=address,undefined,float-divide-by-zero",
    "-fno-sanitize-recover=all",
)
TAILS = {"m1_n1": (1, 1), "m2_n2": (2, 2), "arcs2": (2, None)}
FORMS = [
    (tail, real, emission)
    for tail in TAILS
    for real in ("double", "float")
    for emission in ("straight", "loops")
]
MODELS = {
    **{
        f"{tail}_{real}_{emission}": {"real": real, "emission": emission}
        for tail, real, emission in FORMS
    },
    "m1_n1_baked_straight": {"baked": True, "emission": "straight"},
    "m2_n2_baked_loops": {"baked": True, "emission": "loops"},
    "m2_n2_baked_float": {"baked": True, "emission": "loops", "real": "float"},
    "m2_n2_double_segments": {"emission": "segments"},
    "m2_n2_float_segments": {"real": "float", "emission": "segments"},
    "m1_n1_double_reproducible": {"profile": "reproducible", "emission": "straight"},
    "m2_n2_float_reproducible": {"profile": "reproducible", "emission": "loops", "real": "float"},
}
REPRODUCIBLE = [name for name in MODELS if name.endswith("_reproducible")]
HARDEST = {
    "double": 6381956970095103.0 * 2.0**797,
    "float": 16367173.0 * 2.0**72,
}  # nearest to a multiple of pi/2
del MODELS["arcs2_float_straight"]  # its text is long, and what it shows others show
FEW = {
    "m1_n1_double_straight",
    "m1_n1_float_loops",
    "m1_n1_baked_straight",
    "m2_n2_double_segments",
    "arcs2_double_loops",
    *REPRODUCIBLE,
}  # of every tail, form, real type and option one
some_models = pytest.mark.parametrize(
    "name", ["m1_n1_double_straight", "m1_n1_float_loops", "m1_n1_baked_straight"]
)


def slow_but(*names):
    """Every model, all but the named ones in the slow suite."""
    marked = [
        name if name in names else pytest.param(name, marks=pytest.mark.slow) for name in MODELS
    ]
    return pytest.mark.parametrize("name", marked)


every_model = slow_but(*FEW)
few_of_the_reproducible = pytest.mark.parametrize(
    "name", [REPRODUCIBLE[0], *(pytest.param(n, marks=pytest.mark.slow) for n in REPRODUCIBLE[1:])]
)


class Model(SimpleNamespace):
    """A generated folder: its scene, its paths, its manifest."""

    def __init__(self, name, segments, links, **options):
        self.name, self.folder = name, model_folder(segments, links, name=name, **options)
        self.manifest = json.loads((self.folder / "manifest.json").read_text())
        self.scene = parse_scene(self.manifest["scene"], name)
        self.include, self.header = self.folder / "include", self.folder / "include" / f"{name}.h"
        self.source, self.host, self.batch, self.simulation, self.flights = (
            self.folder / "src" / f"{name}{part}.c"
            for part in ("", "_host", "_batch", "_simulation", "_flights")
        )
        self.example = self.folder / "example" / "main.c"

    @property
    def sources(self):
        """The model, its host entries and, where it has them, its batches, its simulation and its
        flights.
        """
        parts = (self.source, self.host, self.batch, self.simulation, self.flights)
        return [path for path in parts if path.is_file()]

    @property
    def text(self):
        """The text of the model."""
        return self.source.read_text()

    @cached_property
    def objects(self):
        """Plain object files of the model, its host entries, its batches and its simulation."""
        command = ("gcc", *PLAIN, "-c")
        return [compile_once(f"{s.stem}.o", command, [s], self.include) for s in self.sources]


@pytest.fixture(scope="module")
def models():
    """Return a function from a name in MODELS to its generated folder, made once."""
    return cache(lambda name: Model(name, *TAILS[name[:5]], **MODELS[name]))


def run(*command, cwd=None, env=None):
    """Run a command that must succeed; return what it printed."""
    done = subprocess.run(
        list(map(str, command)), capture_output=True, text=True, check=False, cwd=cwd, env=env
    )
    assert done.returncode == 0, f"{shlex.join(map(str, command))}\n{done.stdout}{done.stderr}"
    return done.stdout


def compiled(tmp_path, source, *flags, compiler="gcc"):
    """Return the object file of a source; its compilation says nothing."""
    target = tmp_path / f"{source.stem}{len(list(tmp_path.iterdir()))}.o"
    assert (
        run(compiler, *flags, "-I", source.parent.parent / "include", "-c", source, "-o", target)
        == ""
    )
    return target


def needs(program):
    """Skip, with its name as the reason, what needs a program that is not installed."""
    return pytest.mark.skipif(shutil.which(program) is None, reason=f"{program} is not installed")


# Warnings.


@every_model
@pytest.mark.parametrize("compiler", ["gcc", pytest.param("clang", marks=needs("clang"))])
def test_compiles_without_a_warning(models, tmp_path, compiler, name):
    model = models(name)
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


def symbols(path, *options):
    """Pairs (kind, name) of an object file's symbols."""
    lines = [line.split() for line in run("nm", "-P", *options, path).splitlines()]
    return [(kind, symbol) for symbol, kind, *_ in lines]


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
    header = model.include / f"{model.name}_simulation.h"
    for found, path in ((own, model.header), (simulation, header)):
        assert found == set(re.findall(r"^(?:int|void) (\w+)\(", path.read_text(), re.M))
    names = f"{model.name}_(batch_|abi_hash$)|(jac_|adj1_|jac_adj1_)?{model.name}_casadi_"
    assert all(re.match(names, symbol) for symbol in host)
    assert batch and all(symbol.startswith(f"{model.name}_side_by_side_") for symbol in batch)
    assert all(found == {f"{model.name}_side_by_side_flights"} for found in flights)


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
    q[3], q[7] = 1, 0.5
    v_dot = interpreted(
        model, "forward_dynamics", {"q": q, "v": 0 * q[1:], "tau": 0 * q[7:]}, Numbers()
    )["v_dot"]
    assert [int(k) for k, _ in printed] == list(range(len(v_dot)))
    tolerance = 1e-3 if "float" in name else 1e-6
    np.testing.assert_allclose(
        [float(x) for _, x in printed], v_dot, rtol=tolerance, atol=tolerance
    )


# Numbers.


def float_of(real):
    """The NumPy and ctypes types of a C real."""
    return (np.float32, ctypes.c_float) if real == "float" else (np.float64, ctypes.c_double)


class Arithmetic(Numbers):
    """The arithmetic of a model's C: its rounding, its constants, its own sine and cosine."""

    def __init__(self, library):
        functions = SimpleNamespace(
            sin=lambda x: self.each(x, 0), cos=lambda x: self.each(x, 1), sqrt=None
        )
        super().__init__(functions, library.number)
        self.library = library

    def each(self, x, k):
        """Sine or cosine of a number, or of each lane of a row."""
        return (
            np.array([self.library.sincos(lane)[k] for lane in x])
            if np.ndim(x)
            else self.library.sincos(x)[k]
        )

    def const(self, value):
        """The nearest number of the C type, zero where that type has no normal number so small."""
        nearest = self.convert(float(value))
        return nearest if abs(nearest) >= np.finfo(self.convert).tiny else self.convert(0)


def parameter_values(model):
    """Scalars of the scene's parameters by name."""
    return {name: np.ravel(value).tolist() for name, value in model.scene.parameters.items()}


def interpreted(model, name, arguments, arithmetic):
    """Run a function's program; return its outputs."""
    _, p = in_form(
        model.manifest["functions"][name]["emission"], CATALOGUE[name], tail_of(model.scene)
    )
    known = parameter_values(model) | arguments
    arrays = (*p.of_role("parameters"), *p.of_role("input"))
    values = Run(
        p, arithmetic, {a.name: [arithmetic.convert(x) for x in known[a.name]] for a in arrays}
    ).values
    return {a.name: np.array(values[a.name]) for a in p.of_role("output")}


WRAPPER = """#include "../src/@.c"
void @_wrapped_sincos(const @_real *x, @_real *both);
void @_wrapped_sincos(const @_real *x, @_real *both)
{
  @_sincos(*x, both, both + 1);
}
"""


class Library:
    """The functions of a compiled model, called through ctypes, and its sine and cosine."""

    def __init__(self, model, *flags):
        self.model, path = model, model.folder / f"{'_'.join(['model', *flags])}.so"
        self.number, self.c_type = float_of(model.manifest["real"])
        if not path.exists():
            wrapper = model.folder / "example" / "wrapper.c"
            include, definition = WRAPPER.replace("@", model.name).split("\n", 1)
            wrapper.write_text(f"{include}\n{definition if '_sincos(' in model.text else ''}")
            run(
                "gcc",
                "-std=c99",
                *flags,
                "-fPIC",
                "-shared",
                "-I",
                model.include,
                wrapper,
                "-o",
                path,
                "-lm",
            )
        self.library = ctypes.CDLL(str(path))
        sizes = [p["size"] for p in model.manifest["parameters"] if p["in_struct"]]
        self.parameters = np.full(sum(sizes), np.nan, self.number)
        self.library[f"{model.name}_default_parameters"](self._pointer(self.parameters))

    def sincos(self, x):
        """Sine and cosine as the model computes them."""
        x, both = np.array([x], self.number), np.zeros(2, self.number)
        self.library[f"{self.model.name}_wrapped_sincos"](self._pointer(x), self._pointer(both))
        return both

    def _pointer(self, array):
        return array.ctypes.data_as(ctypes.POINTER(self.c_type))

    def call(self, name, arguments, dirt=np.nan, status=0, spare=True):
        """Call a function with all that it may write filled with dirt; return its outputs.

        Without ``spare``, what the header allows to be null is null.
        """
        entry = self.model.manifest["functions"][name]
        inputs = [np.array(arguments[a["name"]], self.number) for a in entry["inputs"]]
        given = [x.copy() for x in inputs]
        outputs = [np.full(np.prod(a["shape"]), dirt, self.number) for a in entry["outputs"]]
        work = np.full(self.model.manifest["work"][name], dirt, self.number)
        pointers = list(map(self._pointer, [self.parameters, *inputs, *outputs, work]))
        if not spare:
            pointers[0] = None if self.model.scene.baked else pointers[0]
            pointers[-1] = pointers[-1] if work.size else None
        assert self.library[f"{self.model.name}_{name}"](*pointers) == status
        assert all(np.array_equal(x, y, equal_nan=True) for x, y in zip(inputs, given, strict=True))
        return {a["name"]: values for a, values in zip(entry["outputs"], outputs, strict=True)}


def states_of(model, count=2):
    """Arguments by name of a few random states."""
    total, rng = model.manifest["dimensions"]["total"], np.random.default_rng(2)
    rows = zip(*random_states(model.scene.segments, 5, count, "random"), strict=True)
    f_ext = rng.uniform(-1, 1, (count, 6 + 3 * (total + 1)))
    return [
        {"q": q, "v": v, "v_dot": v_dot, "tau": tau, "f_ext": f}
        for (q, v, v_dot, tau), f in zip(rows, f_ext, strict=True)
    ]


def same(some, others):
    """Tell if two sets of outputs are equal, every entry but for the sign of a zero."""
    return some.keys() == others.keys() and all(
        np.array_equal(some[name], others[name]) for name in some
    )


def bits(outputs):
    """The bytes of every output."""
    return {name: values.tobytes() for name, values in outputs.items()}


def assert_means_the_program(model, *flags):
    """Every function gives what its program gives in the model's arithmetic."""
    library = Library(model, *flags)
    for state in states_of(model):
        for function in model.manifest["functions"]:
            found, expected = (
                library.call(function, state),
                interpreted(model, function, state, Arithmetic(library)),
            )
            if model.scene.baked and model.scene.real == "float":  # parameters are folded in double
                for key, values in expected.items():
                    np.testing.assert_allclose(
                        found[key], values, rtol=1e-3, atol=1e-3 * np.abs(values).max()
                    )
            else:
                assert same(found, expected), function


@every_model
def test_c_computes_what_the_program_means_bit_for_bit(models, name):
    assert_means_the_program(models(name))


@slow_but("m1_n1_double_straight", "m1_n1_float_loops")
def test_optimised_c_computes_the_same_bits(models, name):
    assert_means_the_program(models(name), "-O2")


@every_model
def test_result_depends_on_nothing_but_the_input(models, name):
    """Same bits from dirty workspace and outputs, whatever ran before; inputs are left alone."""
    model = models(name)
    library = Library(model)
    first, second = states_of(model)
    for function in model.manifest["functions"]:
        clean = library.call(function, first, dirt=0.0)
        library.call(function, second)
        for dirt in (np.nan, np.inf, -1e30):
            assert bits(library.call(function, first, dirt)) == bits(clean), function


@every_model
def test_default_parameters_are_the_scene_s_to_the_last_bit(models, name):
    model = models(name)
    library = Library(model)
    fields = [p["name"] for p in model.manifest["parameters"] if p["in_struct"]]
    expected = [x for field in fields for x in parameter_values(model)[field]]
    assert library.parameters.tolist() == [library.number(x) for x in expected]


def ulps(found, expected):
    """Distance in units of the last place of the expected number."""
    return abs(mpmath.mpf(float(found)) - expected) / mpmath.mpf(
        float(np.spacing(found.dtype.type(abs(expected))))
    )


@mpmath.workdps(60)
@pytest.mark.parametrize("name", ["m1_n1_double_straight", "m1_n1_float_loops", *REPRODUCIBLE])
def test_sine_and_cosine_are_good_to_the_last_digit(models, name):
    library, rng = Library(models(name)), np.random.default_rng(1)
    angles = [
        *rng.uniform(-4, 4, 300),
        *rng.uniform(-1e5, 1e5, 300),
        *10.0 ** rng.uniform(-300, 8, 100),
    ]
    angles += [k * np.pi / 4 for k in range(-40, 41)] + [
        k * np.pi / 2 for k in (1001, 44444, 63661, 63662, 63663)
    ]
    angles += [
        0.0,
        *(s * x for s in (1, -1) for end in (1e4, 1e5) for x in (end, np.nextafter(end, 0))),
    ]
    angles = np.array(angles).astype(library.number)
    for x in (
        angles
        if name not in REPRODUCIBLE
        else angles[abs(angles) < (1e4 if "float" in name else 1e5)]
    ):
        exact = mpmath.cos_sin(mpmath.mpf(float(x)))[::-1]
        assert all(
            ulps(y, value) <= 1.5 for y, value in zip(library.sincos(x), exact, strict=True)
        ), x


@mpmath.workdps(1000)
@few_of_the_reproducible
def test_reproducible_sine_and_cosine_reduce_any_angle(models, name):
    """Within 3 units of the last place as far as numbers go, without libm, and optimised or not to
    the same bits.
    """
    model, rng = models(name), np.random.default_rng(3)
    library, optimised, largest = (
        Library(model),
        Library(model, "-O2"),
        np.finfo(float_of(model.scene.real)[0]).max,
    )
    angles = 10.0 ** rng.uniform(3.9, np.log10(largest), 2000)
    angles = np.array([*angles, largest, 1e4, 1e5, HARDEST[model.scene.real]]).astype(
        library.number
    )
    angles = np.concatenate([angles, [k * np.pi / 2 for k in rng.integers(1e5, 1e9, 200)]]).astype(
        library.number
    )
    for x in np.concatenate([angles, -angles[::9]]):
        exact = mpmath.cos_sin(mpmath.mpf(float(x)))[::-1]
        found = library.sincos(x)
        assert all(ulps(y, value) <= 3 for y, value in zip(found, exact, strict=True)), x
        assert found.tobytes() == optimised.sincos(x).tobytes()
    assert not {"sin", "cos", "sinf", "cosf"} & {
        symbol for _, symbol in symbols(model.objects[0], "-u")
    }


@pytest.mark.parametrize("name", REPRODUCIBLE)
def test_reproducible_models_refuse_what_would_change_their_bits(models, tmp_path, name):
    model = models(name)
    command = ["gcc", "-I", model.include, "-c", model.source, "-o", tmp_path / "model.o"]
    done = subprocess.run([*command, "-ffast-math"], capture_output=True, text=True, check=False)
    assert (
        done.returncode != 0
        and f"{name} is reproducible: compile it without -ffast-math" in done.stderr
    )


@needs("objdump")
@pytest.mark.skipif(platform.machine() != "x86_64", reason="looks for x86's fused instructions")
@few_of_the_reproducible
def test_reproducible_models_fuse_nothing_even_where_the_compiler_would(models, tmp_path, name):
    """The control is a model of the fast profile, compiled alike."""
    fused = []
    for source in (models(name).source, models("m1_n1_double_straight").source):
        target = compiled(tmp_path, source, "-std=gnu11", "-O2", "-mfma")
        fused.append("vfmadd" in run("objdump", "-d", target))
    assert fused == [False, True]


@pytest.mark.parametrize("name", ["m1_n1_double_straight", "m1_n1_float_loops", *REPRODUCIBLE])
def test_sine_and_cosine_at_the_edges(models, name):
    library = Library(models(name))
    assert library.sincos(0.0).tolist() == [0, 1]
    assert library.sincos(-0.5).tolist() == (library.sincos(0.5) * [-1, 1]).tolist()
    assert all(np.isnan(library.sincos(x)).all() for x in (np.nan, np.inf, -np.inf))


NUMBER = r"(?<![\w.])\d+(?:\.\d+(?:[eE][-+]?\d+)?|[eE][-+]?\d+)f?"


@every_model
def test_numbers_are_shortest_exact_decimals_of_the_right_type(models, name):
    model = models(name)
    code = re.sub(r"/\*.*?\*/|\"[^\"\n]*\"", "", model.text + model.host.read_text(), flags=re.S)
    code += re.sub(r"/\*.*?\*/|\"[^\"\n]*\"", "", model.simulation.read_text(), flags=re.S)
    literals = set(re.findall(NUMBER, code))
    assert len(literals) > 10
    suffix = "f" if model.manifest["real"] == "float" else ""
    assert {
        text for text in literals if len(text) > len(repr(float(text.rstrip("f")))) + len(suffix)
    } == set()
    assert {text for text in literals if text.endswith("f") != bool(suffix)} == set()


@every_model
def test_not_a_number_is_reported(models, name):
    model = models(name)
    state = states_of(model)[0]
    state["q"][7] = np.nan
    status = 3 if model.scene.kind == "continuum" else 1  # out of range, or H not positive definite
    Library(model).call("forward_dynamics", state, status=status)


@every_model
def test_what_the_header_lets_be_null_is_not_read(models, name):
    library, state = Library(models(name)), states_of(models(name))[0]
    for function in library.model.manifest["functions"]:
        assert bits(library.call(function, state, spare=False)) == bits(
            library.call(function, state)
        ), function


SWAP = Step(
    "swap",
    "Exchange.",
    (("x", 3),),
    (("x", 3),),
    (("input", 0), ("input", 1), ("neg", 0)),
    (1, 2, 0),
)


def test_outputs_of_a_step_may_overwrite_its_inputs(tmp_path):
    lines = "\n".join(routine_lines(Routine(SWAP), "double", "x"))
    source, path = tmp_path / "swap.c", tmp_path / "swap.so"
    source.write_text(
        f"#define real double\nvoid swap(const real *x, real *x_out)\n{{\n{lines}\n}}\n"
    )
    run("gcc", "-std=c99", "-shared", "-fPIC", source, "-o", path)
    x = (ctypes.c_double * 3)(1, 2, 3)
    ctypes.CDLL(str(path)).swap(x, x)
    assert list(x) == [2, -1, 1]


# Size and arithmetic.


def test_text_of_a_long_tail_is_bounded():
    """Under 100 kB for all functions of values, 45 kB more for the Jacobians of forward
    dynamics.
    """
    values = [name for name in NAMES if name not in DERIVATIVES]

    def size(segments, links, functions):
        return (
            Model("tail", segments, links, emission="loops", functions=functions)
            .source.stat()
            .st_size
        )

    assert size(8, 16, values) < 100_000
    assert size(8, 16, NAMES) < size(8, 16, values) + 45_000
    assert size(8, 16, NAMES) < 1.02 * size(3, 4, NAMES)


def test_automatic_form_is_straight_until_the_code_grows_large():
    def emission(size, **options):
        model = Model("one", *size, functions=["forward_dynamics"], **options)
        return model.manifest["functions"]["forward_dynamics"]["emission"]

    assert (emission((1, 1)), emission((8, 16))) == ("straight", "segments")
    assert emission((1, 1), emission="loops") == "loops"


@needs("objdump")
@pytest.mark.skipif(
    platform.machine() not in ("x86_64", "AMD64"), reason="looks for x86-64 instructions"
)
@pytest.mark.parametrize(
    "name", ["m1_n1_float_straight", pytest.param("m2_n2_float_loops", marks=pytest.mark.slow)]
)
def test_float_model_has_no_double_arithmetic(models, tmp_path, name):
    double = re.compile(r"\bv?(?:cvtss2sd|cvtsd2ss|(?:add|sub|mul|div|sqrt)[sp]d)\b")
    for source in models(name).sources:
        code = run("objdump", "-d", "--no-show-raw-insn", compiled(tmp_path, source, *PLAIN, "-O2"))
        assert double.findall(code) == []
    reference = compiled(tmp_path, models("m1_n1_double_straight").source, *PLAIN, "-O2")
    assert double.findall(run("objdump", "-d", "--no-show-raw-insn", reference))


@every_model
def test_wrapped_lines_and_no_trailing_blanks(models, name):
    model = models(name)
    for path in (
        model.header,
        *model.sources,
        model.include / f"{name}_simulation.h",
        model.example,
    ):
        text = path.read_text()
        assert text.isascii() and text.endswith("\n") and not text.endswith("\n\n")
        assert not re.search(r"[ \t]+$", text, re.M)


# Memory.

DRIVER = """#include "@_host.c"

#include <stdio.h>
#include <stdlib.h>

#define real @_real

static unsigned seed = 1u;

static real *heap(long long size, int random)
{
  real *block = size ? malloc((size_t)size * sizeof *block) : NULL;
  for (long long k = 0; k < size; ++k) {
    seed = seed * 1664525u + 1013904223u;
    block[k] = random ? (real)((int)(seed >> 8) % 2000 - 1000) / 1000 : 0;
  }
  return block;
}

static int call(int (*batch)(@_call *), int inputs, int outputs, const int *length, int work)
{
  @_parameters *parameters = malloc(sizeof *parameters);
  @_call it = { parameters, 3, 0, heap(work, 1), { NULL } };
  @_default_parameters(parameters);
  for (int k = 0; k < inputs + outputs; ++k) {
    it.arrays[k] = heap(3 * length[k], k < inputs);
  }
  const int status = batch(&it);
  for (int k = 0; k < inputs + outputs; ++k) {
    free(it.arrays[k]);
  }
  free(it.work);
  free(parameters);
  return status;
}
"""

CASADI_DRIVER = """
typedef const long long *sizes(long long);
typedef const char *names(long long);

static int external(int (*f)(const real **, real **, long long *, real *, int),
                    int (*work)(long long *, long long *, long long *, long long *), sizes *in, names *name,
                    sizes *out)
{
  long long n_in, n_out, n_iw, n_w;
  work(&n_in, &n_out, &n_iw, &n_w);
  real **arg = malloc((size_t)n_in * sizeof *arg), **res = malloc((size_t)n_out * sizeof *res);
  for (long long k = 0; k < n_in; ++k) {
    arg[k] = heap(in(k)[0] * in(k)[1], 1);
    if (!strcmp(name(k), "parameters")) {
      @_parameters parameters;
      @_default_parameters(&parameters);
      memcpy(arg[k], &parameters, sizeof parameters);
    }
  }
  for (long long k = 0; k < n_out; ++k) {
    res[k] = heap(out(k)[0] * out(k)[1], 1);
  }
  real *w = heap(n_w, 1);
  const int status = f((const real **)arg, res, NULL, w, 0);
  for (long long k = 0; k < n_in + n_out; ++k) {
    free(k < n_in ? arg[k] : res[k - n_in]);
  }
  free(arg);
  free(res);
  free(w);
  return status;
}
"""

ROLLOUT = """  for (int method = @@_RK4; method <= @@_TSIT5; ++method) {
    enum { NQ = @@_NQ, NV = @@_NV, NT = @@_NT, SAMPLES = 3 };
    @_parameters parameters;
    @_default_parameters(&parameters);
    real *q = heap(NQ, 1), *v = heap(NV, 1), *q_out = heap(SAMPLES * NQ, 0), *v_out = heap(SAMPLES * NV, 0);
    real *tau_out = heap(SAMPLES * NT, 0), *times = heap(SAMPLES, 0), *stop = heap(1, 0), *damping = heap(NT, 0);
    real *table_times = heap(2, 0), *coefficients = heap(2 * NT, 1), *work = heap(@@_WORK_ROLLOUT, 1);
    times[1] = (real)0.0003;
    times[2] = (real)0.001;
    stop[0] = table_times[1] = (real)0.0005;
    @_piecewise table = { 1, NT, 1, table_times, coefficients };
    @_controller controller = { 0 };
    controller.damping = damping;
    controller.torques = &table;
    real *begins = heap(1, 0);
    @_drive drive = { 1, begins, &controller, 1, stop };
    @_run run = { 0 };
    run.parameters = &parameters;
    run.drive = &drive;
    run.q = q;
    run.v = v;
    run.method = method;
    run.rtol = run.atol = (real)0.001;
    run.step = (real)0.0001;
    run.most_step = 1;
    run.most_steps = run.pause = 1000;
    run.samples = SAMPLES;
    run.times = times;
    run.q_out = q_out;
    run.v_out = v_out;
    run.tau_out = tau_out;
    run.work = work;
    //ground
    bad += @_rollout(&run) != 0 || run.done != SAMPLES || run.steps < 2;
    real *all[] = { q, v, q_out, v_out, tau_out, times, stop, damping, table_times, coefficients, work, begins };
    for (size_t k = 0; k < sizeof all / sizeof *all; ++k) {
      free(all[k]);
    }
  }
"""


GROUND = """q[2] = 0;
    real *legs = heap(4, 1), *event_times = heap(3, 0);
    int *event_kinds = malloc(3 * sizeof *event_kinds);
    @_piecewise stance = { 1, 4, 0, table_times, legs };
    drive.legs = &stance;
    run.bristles = heap(2 * @@_CONTACTS, 0);
    run.bristles_out = heap(SAMPLES * 2 * @@_CONTACTS, 0);
    run.event_times = event_times;
    run.event_kinds = event_kinds;
    run.most_events = 3;
"""


def driver(model):
    """C text that calls every function of a model on exact-sized heap blocks."""
    double = model.manifest["real"] == "double"
    calls = ""
    for name, entry in model.manifest["functions"].items():
        lengths = [int(np.prod(a["shape"])) for a in (*entry["inputs"], *entry["outputs"])]
        counts = f"{len(entry['inputs'])}, {len(entry['outputs'])}"
        calls += (
            f"  bad += call(@_batch_{name}, {counts}, (const "
            f"int[]){{ {', '.join(map(str, lengths))} }}, "
        )
        calls += f"@@_WORK_{name.upper()}) != 0;\n"
    for c in re.findall(r"^int (\w+)\(const real \*\*arg.*;$", model.host.read_text(), re.M):
        calls += (
            f"  bad += external({c}, {c}_work, {c}_sparsity_in, "
            f"{c}_name_in, {c}_sparsity_out) != 0;\n"
        )
    text = DRIVER + (CASADI_DRIVER if double else "")
    if "rollout" in model.scene.functions:
        text = '#include "@_simulation.h"\n' + text
    text += (
        f"\nint "
        f"main(void)\n{{\n  int bad = 0;\n{calls}{ROLLOUT if 'rollout' in model.scene.functions else ''}"
    )
    text += '  printf("%d bad\\n", bad);\n  return bad;\n}\n'
    text = text.replace("//ground", GROUND if model.scene.contacts else "")
    if model.scene.contacts:
        text = text.replace("method <= @@_TSIT5", "method <= @@_IMPLICIT_EULER")
    return text.replace("@@", model.name.upper()).replace("@", model.name)


@slow_but("m1_n1_double_loops")
def test_sanitizers_find_nothing(models, tmp_path, name):
    model, main = models(name), tmp_path / "main.c"
    main.write_text(driver(model))
    folders = ("-I", model.include, "-I", model.host.parent)
    run(
        "gcc",
        *SANITIZED,
        *folders,
        main,
        model.source,
        model.simulation,
        "-o",
        tmp_path / "main",
        "-lm",
    )
    assert run(tmp_path / "main", env={"ASAN_OPTIONS": "detect_leaks=1"}) == "0 bad\n"


@pytest.mark.slow
def test_sanitizers_find_nothing_on_the_ground(tmp_path):
    functions = ["energy", "rollout", "implicit", "pfl"]
    model = Model(
        "ground", 1, 2, contacts=["feet", "tail", "torso"], functions=functions, emission="loops"
    )
    for source in model.sources:
        compiled(tmp_path, source, *C99, "-O2")
    main, any_damping = tmp_path / "main.c", "call(@_batch_implicit_factor".replace("@", model.name)
    # damping at random is below zero, too, and its matrix then not positive definite
    main.write_text(driver(model).replace(f"bad += {any_damping}", f"bad += 0 * {any_damping}"))
    folders = ("-I", model.include, "-I", model.host.parent)
    run(
        "gcc",
        *SANITIZED,
        *folders,
        main,
        model.source,
        model.simulation,
        "-o",
        tmp_path / "main",
        "-lm",
    )
    assert run(tmp_path / "main", env={"ASAN_OPTIONS": "detect_leaks=0"}) == "0 bad\n"


def test_sanitizers_would_find_a_short_workspace(tmp_path):
    model = Model("short", 1, 1, functions=["forward_dynamics"], emission="loops")
    main = tmp_path / "main.c"
    needed = f"{model.name.upper()}_WORK_FORWARD_DYNAMICS"
    # less a vector: that much of the last row of a matrix to factor is room
    main.write_text(driver(model).replace(f"{needed})", f"{needed} - 8)"))
    folders = ("-I", model.include, "-I", model.host.parent)
    run("gcc", *SANITIZED, *folders, main, model.source, "-o", tmp_path / "main", "-lm")
    done = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=False)
    assert done.returncode != 0 and "heap-buffer-overflow" in done.stderr

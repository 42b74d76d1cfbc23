"""The C means what its program means, bit for bit, and its sine and cosine are exact enough."""

import ctypes
import platform
import re
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest

from serpentail.compiling.compiler import compile_library
from serpentail_codegen.ir.interpret import Numbers
from tests.support.rows import row

from .emitted import (
    NAMES,
    bits,
    compiled,
    interpreted,
    library_of,
    model_of,
    needs,
    parameter_values,
    run,
    states_of,
    symbols,
)

# of every form, real type, tail and option one
QUICK = ("m1_n1", "small", "segments", "arcs1", "baked")
SLOW = ("reproducible", "straight", "loops", "lanes", "single", "arcs2_loops", "polar", "mixed")
OPTIMISED = ("small", "straight", "lanes")
HARDEST = {  # nearest to a multiple of pi/2
    "double": 6381956970095103.0 * 2.0**797,
    "float": 16367173.0 * 2.0**72,
}


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
        if np.ndim(x):
            return np.array([self.library.sincos(lane)[k] for lane in x])
        return self.library.sincos(x)[k]

    def const(self, value):
        """The nearest number of the C type, zero where that type has no normal number so small."""
        nearest = self.convert(float(value))
        return nearest if abs(nearest) >= np.finfo(self.convert).tiny else self.convert(0)


def assert_means_the_program(library, function, state):
    """A function gives what its program gives in the model's arithmetic, but for signs of zeros."""
    model, found = library.model, library.call(function, state)
    expected = interpreted(model, function, state, Arithmetic(library))
    assert found.keys() == expected.keys()
    for key, values in expected.items():
        if model.scene.baked and model.scene.real == "float":  # parameters are folded in double
            most = 1e-3 * np.abs(values).max()
            np.testing.assert_allclose(found[key], values, rtol=1e-3, atol=most)
        else:
            np.testing.assert_array_equal(found[key], values)


def assert_depends_on_its_input_alone(library, function, first, second):
    """Same bits from dirty workspace and outputs, whatever ran before; inputs are left alone."""
    clean = library.call(function, first, dirt=0.0)
    library.call(function, second)
    for dirt in (np.nan, np.inf, -1e30):
        assert bits(library.call(function, first, dirt)) == bits(clean)
    assert bits(library.call(function, first, spare=False)) == bits(clean)


@pytest.mark.parametrize(
    "models", [QUICK, pytest.param(SLOW, marks=pytest.mark.slow)], ids=["quick", "others"]
)
def test_c_computes_what_the_program_means_bit_for_bit(models):
    for name in models:
        model = model_of(name)
        library = library_of(model)
        fields = [p["name"] for p in model.manifest["parameters"] if p["in_struct"]]
        expected = [x for field in fields for x in parameter_values(model)[field]]
        assert library.parameters.tolist() == [library.number(x) for x in expected], name
        first, second = states_of(model)
        for function in model.manifest["functions"]:
            with row(name, function):
                assert_depends_on_its_input_alone(library, function, first, second)
                for state in (first, second) if function in NAMES else ():
                    assert_means_the_program(library, function, state)
                if function in NAMES and name in OPTIMISED:
                    assert_means_the_program(library_of(model, "-O2"), function, first)
        first["q"][7] = np.nan
        library.call("forward_dynamics", first, status=2)


# Sine and cosine


def ulps(x, found):
    """How far sine and cosine are off, in units of the last place of the exact ones."""
    off = []
    for y, exact in zip(found, mpmath.cos_sin(mpmath.mpf(float(x)))[::-1], strict=True):
        unit = np.spacing(y.dtype.type(abs(exact)))
        off.append(abs(mpmath.mpf(float(y)) - exact) / mpmath.mpf(float(unit)))
    return max(off)


def angles(number):
    """Angles of all sizes, around multiples of pi / 4 and the ends of ranges."""
    rng = np.random.default_rng(1)
    found = [*rng.uniform(-4, 4, 200), *rng.uniform(-1e4, 1e4, 100), *rng.uniform(-1e5, 1e5, 100)]
    found += [*10.0 ** rng.uniform(-300, 8, 100), *(k * np.pi / 4 for k in range(-40, 41))]
    found += [k * np.pi / 2 for k in (1001, 6366, 44444, 63661, 63662, 63663)]
    ends = [number(end) for end in (1e4, 1e5)]
    sizes = [x for end in ends for x in (np.nextafter(end, 0), end, np.nextafter(end, 2 * end))]
    return np.array([*found, 0.0, *sizes, *(-x for x in sizes)]).astype(number)


@mpmath.workdps(60)
def test_sine_and_cosine_are_good_to_the_last_digit():
    """Of each profile in each real type."""
    for name in ("m1_n1", "single", "reproducible", "small"):
        model = model_of(name)
        library = library_of(model)
        most = np.inf
        if model.scene.profile == "reproducible":
            most = 1e4 if model.scene.real == "float" else 1e5
        with row(name):
            for x in angles(library.number):
                assert abs(x) >= most or ulps(x, library.sincos(x)) <= 1.5, x
            assert library.sincos(0.0).tolist() == [0, 1]
            assert library.sincos(-0.5).tolist() == (library.sincos(0.5) * [-1, 1]).tolist()
            assert all(np.isnan(library.sincos(x)).all() for x in (np.nan, np.inf, -np.inf))


ROWS = """
int row_lanes(void);
int row_lanes(void) { return LANES; }
void row(const real *x, real *sine, real *cosine);
void row(const real *x, real *sine, real *cosine) {
  lanes a;
  for (int k = 0; k < LANES; ++k) ((real *)&a)[k] = x[k];
  @_sincos_row(a, (lanes *)sine, (lanes *)cosine);
}
"""


@mpmath.workdps(60)
@pytest.mark.parametrize("name", ["bare", "single"])
def test_sine_and_cosine_of_rows_are_good_to_the_last_digit(tmp_path, name):
    model, file = model_of(name), tmp_path / "rows.c"
    source = (model.folder / "src" / f"{name}_batch.c").read_text()
    file.write_text(re.sub(r"#undef (lanes|LANES|real)\b", "", source) + ROWS.replace("@", name))
    library = ctypes.CDLL(str(compile_library([file], model.include)))
    width, number = library.row_lanes(), np.float32 if name == "single" else np.float64
    given = np.append(angles(number), np.array([np.inf, -np.inf], number))
    given = np.append(given, np.full(-len(given) % width, np.nan, number)).reshape(-1, width)
    x, sine, cosine = memory = np.zeros((3, width), number)
    for some in given:
        x[:] = some
        library.row(*(ctypes.c_void_p(a.ctypes.data) for a in memory))
        for each, *found in zip(x, sine, cosine, strict=True):
            with row(each):
                assert ulps(each, found) <= 1.5 if np.isfinite(each) else np.isnan(found).all()


@mpmath.workdps(1000)
@pytest.mark.parametrize("name", ["small", pytest.param("reproducible", marks=pytest.mark.slow)])
def test_reproducible_sine_and_cosine_reduce_any_angle(name):
    """Within 3 units of the last place as far as numbers go, without libm, and optimised or not to
    the same bits.
    """
    model, rng = model_of(name), np.random.default_rng(3)
    library, optimised = library_of(model), library_of(model, "-O2")
    largest, hardest = np.finfo(library.number).max, HARDEST[model.scene.real]
    some = [*10.0 ** rng.uniform(3.9, np.log10(largest), 1000), largest, 1e4, 1e5, hardest]
    some += [k * np.pi / 2 for k in rng.integers(1e5, 1e9, 200)]
    some = np.array(some).astype(library.number)
    for x in np.concatenate([some, -some[::9]]):
        found = library.sincos(x)
        assert ulps(x, found) <= 3, x
        assert found.tobytes() == optimised.sincos(x).tobytes()
    wanted = {symbol for _, symbol in symbols(model.objects[""], "-u")}
    assert not {"sin", "cos", "sinf", "cosf"} & wanted


def test_powers_of_step_lengths_are_exact_enough_without_libm(tmp_path):
    for name, most in (("small", 1e-5), ("reproducible", 1e-13)):
        model = model_of(name)
        text = model.simulation.read_text()
        assert not re.search(r"\bpowf?\(", text)
        real, source = f"{model.name}_real", tmp_path / f"{name}.c"
        own = f"{real} own_power({real} x, {real} a) {{ return {model.name}_power(x, a); }}"
        source.write_text(f"{text}\n{own}\n")
        power = ctypes.CDLL(str(compile_library([model.source, source], model.include))).own_power
        kind = ctypes.c_float if name == "small" else ctypes.c_double
        power.argtypes, power.restype = (kind, kind), kind
        limits = np.finfo(np.dtype(kind))
        sizes = [limits.tiny, 1e-30, 1e-6, 0.3, 0.999, 1.0, 7.5, 1e12, limits.max]
        for x in (kind(size).value for size in sizes):
            for a in (-0.85, -0.17, 0.04, 1 / 3):
                assert power(x, a) == pytest.approx(x ** kind(a).value, rel=most), (name, x, a)
        assert (
            np.isnan(power(np.nan, 0.2)) and power(0.0, 0.2) < 1e-7 and power(np.inf, -0.2) < 1e-7
        )


@needs("objdump")
@pytest.mark.skipif(platform.machine() != "x86_64", reason="looks for x86's instructions")
def test_reproducible_models_fuse_nothing_and_float_ones_have_no_double_arithmetic(tmp_path):
    """The control is a model of the fast profile in double, compiled alike."""
    double = re.compile(r"\bv?(?:cvtss2sd|cvtsd2ss|(?:add|sub|mul|div|sqrt)[sp]d)\b")
    flags, found = ("-std=gnu11", "-O2", "-mfma", "-fno-stack-protector", "-fno-pic"), []
    for model in map(model_of, ("small", "bare")):
        sources = [model.source, model.host, model.simulation][: 1 if model.name == "bare" else 3]
        codes = [
            run("objdump", "-d", "--no-show-raw-insn", compiled(tmp_path, source, *flags))
            for source in sources
        ]
        code = "".join(codes)
        found.append(("vfmadd" in code, bool(double.search(code))))
    assert found == [(False, False), (True, True)]

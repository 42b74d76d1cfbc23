"""The C text: it compiles without a warning, means what its program means bit for bit, and keeps to
itself.
"""

import platform
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest

from serpentail_codegen.ir.interpret import Numbers

from .emitted import (
    REPRODUCIBLE,
    Library,
    bits,
    compiled,
    every_model,
    float_of,
    interpreted,
    needs,
    parameter_values,
    run,
    slow_but,
    states_of,
    symbols,
)

HARDEST = {
    "double": 6381956970095103.0 * 2.0**797,
    "float": 16367173.0 * 2.0**72,
}  # nearest to a multiple of pi/2
few_of_the_reproducible = pytest.mark.parametrize(
    "name", [REPRODUCIBLE[0], *(pytest.param(n, marks=pytest.mark.slow) for n in REPRODUCIBLE[1:])]
)


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


def same(some, others):
    """Tell if two sets of outputs are equal, every entry but for the sign of a zero."""
    return some.keys() == others.keys() and all(
        np.array_equal(some[name], others[name]) for name in some
    )


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

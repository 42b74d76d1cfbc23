"""Batches: states side by side give what each of them gives alone, in any number, from any thread,
errors included.
"""

import ctypes

import mpmath
import numpy as np
import pytest

from serpentail.model.compiler import compile_library
from serpentail_codegen.targets.c.batch import STATES

from .tails import FREE, alone, evaluated, given, model, states

FORMS = [
    pytest.param(
        tail,
        emission,
        real,
        marks=() if real == "double" and emission == usual else pytest.mark.slow,
    )
    for tail, usual in ((("articulated", 2, 2), "straight"), (("continuum", 2, None), "loops"))
    for emission in ("straight", "loops")
    for real in ("double", "float")
]
every_form = pytest.mark.parametrize(("tail", "emission", "real"), FORMS)


# The compiled batches.


@every_form
@pytest.mark.parametrize("name", FREE)
def test_any_number_of_states_gives_what_each_gives_alone(tail, emission, real, name):
    found = model(*tail, emission=emission, real=real)
    arguments = states(found, 37)
    expected = alone(found, name, arguments)
    scale, digits = np.abs(expected).max(axis=0), np.finfo(expected.dtype).eps
    for count in (1, 7, *range(STATES[real], len(expected), STATES[real] - 3), len(expected)):
        out = evaluated(found, name, [a[:count] for a in given(arguments, name)])
        assert out.dtype == expected.dtype
        assert (np.abs(out - expected[:count]) <= 3e3 * digits * scale).all()


@pytest.mark.parametrize("tail", [("articulated", 2, 2), ("continuum", 2, None)])
@pytest.mark.parametrize("emission", ["loops", pytest.param("straight", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", FREE)
def test_the_reproducible_profile_gives_the_same_bits(tail, emission, name):
    found = model(*tail, profile="reproducible", emission=emission)
    arguments = states(found, 11)
    together = evaluated(found, name, given(arguments, name))
    assert np.array_equal(together, alone(found, name, arguments))


@mpmath.workdps(60)
@pytest.mark.parametrize("real", ["double", "float"])
def test_sine_and_cosine_of_rows_are_good_to_the_last_digit(tmp_path, real):
    found = model(real=real)
    source = (found.folder / "src" / f"{found.name}_batch.c").read_text()
    source = (
        source.replace("#undef lanes", "").replace("#undef LANES", "").replace("#undef real", "")
    )
    name, number = found.name, np.float32 if real == "float" else np.float64
    source += f"""
int row_lanes(void);
int row_lanes(void) {{ return LANES; }}
void row(const real *x, real *sine, real *cosine);
void row(const real *x, real *sine, real *cosine) {{
  lanes a;
  for (int k = 0; k < LANES; ++k) ((real *)&a)[k] = x[k];
  {name}_sincos_row(a, (lanes *)sine, (lanes *)cosine);
}}
"""
    file = tmp_path / "rows.c"
    file.write_text(source)
    library = ctypes.CDLL(str(compile_library([file], found.folder / "include")))
    width, rng = library.row_lanes(), np.random.default_rng(3)
    far, least = (number(1e4), -40) if real == "float" else (number(1e5), -300)
    angles = [
        *rng.uniform(-4, 4, 320),
        *rng.uniform(-far, far, 320),
        *10.0 ** rng.uniform(least, 8, 96),
    ]
    angles += [k * np.pi / 4 for k in range(-40, 40)] + [
        k * np.pi / 2 for k in rng.integers(0, int(far / 2), 160)
    ]
    angles += [
        0.0,
        far,
        -far,
        np.nextafter(far, 2 * far),
        -np.nextafter(far, 2 * far),
        np.inf,
        -np.inf,
    ]
    angles = np.array(angles + [np.nan] * (-len(angles) % width)).astype(number).reshape(-1, width)
    pointer = [np.zeros(width, number) for _ in range(3)]
    for row in angles:
        pointer[0][:] = row
        library.row(*(ctypes.c_void_p(a.ctypes.data) for a in pointer))
        for x, sine, cosine in zip(row, *pointer[1:], strict=True):
            if not np.isfinite(x):
                assert np.isnan(sine) and np.isnan(cosine)
                continue
            exact = mpmath.cos_sin(mpmath.mpf(float(x)))[::-1]
            for y, value in zip((sine, cosine), exact, strict=True):
                assert abs(mpmath.mpf(float(y)) - value) <= 1.5 * float(
                    np.spacing(number(abs(value)))
                ), x

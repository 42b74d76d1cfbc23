"""The C text: it compiles without a warning, means what its program means bit for bit, and keeps to
itself.
"""

import platform
import re

import pytest

from serpentail_codegen.scene.signatures.table import DERIVATIVES

from .emitted import NAMES, PLAIN, Model, compiled, every_model, needs, run

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
    assert (emission((2, 15)), emission((2, 16))) == ("lanes", "segments")
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

"""The C text: it compiles without a warning, means what its program means bit for bit, and keeps to
itself.
"""

import ctypes
import json
import shlex
import shutil
import subprocess
from functools import cached_property
from types import SimpleNamespace

import numpy as np
import pytest

from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.ir.interpret import Run
from serpentail_codegen.pipeline import tail_of
from serpentail_codegen.scene.parse import parse_scene
from serpentail_codegen.scene.signatures.table import ALL, DEFAULT, VALUES
from serpentail_codegen.targets.c.form import in_form

from ...references.parameters import random_states
from ...support.compile_once import compile_once
from ...support.models import model_folder

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
CONTACT = ("_batch_contact", "_ground")  # sources of models that touch the ground
PLAIN = ("-std=c99", "-fno-stack-protector", "-fno-pic")
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
del MODELS["arcs2_float_straight"]  # its text is long, and what it shows others show
FEW = {
    "m1_n1_double_straight",
    "m1_n1_float_loops",
    "m1_n1_baked_straight",
    "m2_n2_double_segments",
    "arcs2_double_loops",
    *REPRODUCIBLE,
}  # of every tail, form, real type and option one


def slow_but(*names):
    """Every model, all but the named ones in the slow suite."""
    marked = [
        name if name in names else pytest.param(name, marks=pytest.mark.slow) for name in MODELS
    ]
    return pytest.mark.parametrize("name", marked)


every_model = slow_but(*FEW)


class Model(SimpleNamespace):
    """A generated folder: its scene, its paths, its manifest."""

    def __init__(self, name, segments, links, **options):
        self.name, self.folder = name, model_folder(segments, links, name=name, **options)
        self.manifest = json.loads((self.folder / "manifest.json").read_text())
        self.scene = parse_scene(self.manifest["scene"], name)
        self.include, self.header = self.folder / "include", self.folder / "include" / f"{name}.h"
        self.source, self.host, self.batch, self.simulation, self.flights, *self.contact = (
            self.folder / "src" / f"{name}{part}.c"
            for part in ("", "_host", "_batch", "_simulation", "_flights", *CONTACT)
        )
        self.example = self.folder / "example" / "main.c"

    @property
    def sources(self):
        """The model, its host entries and, where it has them, its batches, its simulation, its
        flights and its batches of contact.
        """
        parts = (self.source, self.host, self.batch, self.simulation, self.flights, *self.contact)
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


def symbols(path, *options):
    """Pairs (kind, name) of an object file's symbols."""
    lines = [line.split() for line in run("nm", "-P", *options, path).splitlines()]
    return [(kind, symbol) for symbol, kind, *_ in lines]


# Numbers.


def float_of(real):
    """The NumPy and ctypes types of a C real."""
    return (np.float32, ctypes.c_float) if real == "float" else (np.float64, ctypes.c_double)


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


def bits(outputs):
    """The bytes of every output."""
    return {name: values.tobytes() for name, values in outputs.items()}

"""Generated folders and what C compilers, linkers and ctypes make of them."""

import ctypes
import json
import shlex
import shutil
import subprocess
from functools import cache, cached_property
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.ir.interpret import Run
from serpentail_codegen.pipeline import tail_of
from serpentail_codegen.scene.parse import parse_scene
from serpentail_codegen.targets.c.form import in_form
from serpentail_scene.signatures.table import ALL, NEEDS, VALUES
from tests.references.parameters import random_states
from tests.support import zoo
from tests.support.compile_once import compile_once
from tests.support.models import folder_of

KNOWN = (*VALUES, "forward_dynamics_derivatives", "rollout")
NAMES = tuple(name for name in ALL if name in KNOWN and name not in NEEDS)
STRICT = (
    *("-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Wshadow"),
    "-Werror",
)
C99 = ("-std=c99", *STRICT)
PLAIN = ("-std=c99", "-fno-stack-protector", "-fno-pic")


class Model:
    """A generated folder: its scene, its paths, its manifest."""

    def __init__(self, folder):
        self.folder, self.name = folder, folder.name
        self.manifest = json.loads((folder / "manifest.json").read_text())
        self.scene = parse_scene(self.manifest["scene"], self.name)
        self.include, self.header = folder / "include", folder / "include" / f"{self.name}.h"
        self.source, self.host, self.simulation = (
            folder / "src" / f"{self.name}{part}.c" for part in ("", "_host", "_simulation")
        )
        self.example = folder / "example" / "main.c"

    @property
    def sources(self):
        """All files of C, but the example."""
        return sorted((self.folder / "src").glob("*.c"))

    @cached_property
    def objects(self):
        """Plain object files of all sources by the end of their names."""
        command = ("gcc", *PLAIN, "-c")
        return {
            source.stem.removeprefix(self.name): compile_once(
                f"{source.stem}.o", command, [source], self.include
            )
            for source in self.sources
        }


@cache
def model_of(name, **changes):
    """Return a model of the zoo, or one of other functions, form or numbers."""
    return Model(folder_of(zoo.scene(name, **changes)) if changes else zoo.folder(name))


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
    places = ("-I", source.parent.parent / "include")
    assert run(compiler, *flags, *places, "-c", source, "-o", target) == ""
    return target


def needs(program):
    """Skip, with its name as the reason, what needs a program that is not installed."""
    return pytest.mark.skipif(shutil.which(program) is None, reason=f"{program} is not installed")


def symbols(path, *options):
    """Pairs (kind, name) of an object file's symbols."""
    lines = [line.split() for line in run("nm", "-P", *options, path).splitlines()]
    return [(kind, symbol) for symbol, kind, *_ in lines]


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
    given = {a.name: [arithmetic.convert(x) for x in known[a.name]] for a in arrays}
    values = Run(p, arithmetic, given).values
    return {a.name: np.array(values[a.name]) for a in p.of_role("output")}


WRAPPER = """
void wrapped_sincos(const @_real *x, @_real *both);
void wrapped_sincos(const @_real *x, @_real *both)
{
  @_sincos(*x, both, both + 1);
}
"""


class Library:
    """The functions of a compiled model, called through ctypes, and its sine and cosine."""

    def __init__(self, model, *flags, compiler="gcc", text=None):
        self.model, single = model, model.manifest["real"] == "float"
        self.number, self.c_type = (
            (np.float32, ctypes.c_float) if single else (np.float64, ctypes.c_double)
        )
        text = text or model.source.read_text()
        with TemporaryDirectory() as temporary:
            wrapper = Path(temporary) / "wrapper.c"
            own = WRAPPER.replace("@", model.name) if "_sincos(" in text else ""
            wrapper.write_text(text + own)
            command = (compiler, "-std=c99", *flags, "-fPIC", "-shared")
            path = compile_once("model.so", command, [wrapper], model.include)
        self.library = ctypes.CDLL(str(path))
        sizes = [p["size"] for p in model.manifest["parameters"] if p["in_struct"]]
        self.parameters = np.full(sum(sizes), np.nan, self.number)
        self.library[f"{model.name}_default_parameters"](self._pointer(self.parameters))

    def sincos(self, x):
        """Sine and cosine as the model computes them."""
        x, both = np.array([x], self.number), np.zeros(2, self.number)
        self.library["wrapped_sincos"](self._pointer(x), self._pointer(both))
        return both

    def _pointer(self, array):
        return array.ctypes.data_as(ctypes.POINTER(self.c_type))

    def call(self, name, arguments, dirt=np.nan, status=0, spare=True):
        """Call a function with all that it may write filled with dirt; return its outputs.

        The workspace begins within a vector. Without ``spare``, what the header allows to be null
        is null.
        """
        entry = self.model.manifest["functions"][name]
        inputs = [np.array(arguments[a["name"]], self.number) for a in entry["inputs"]]
        given = [x.copy() for x in inputs]
        outputs = [np.full(np.prod(a["shape"]), dirt, self.number) for a in entry["outputs"]]
        work = np.full(self.model.manifest["work"][name] + 1, dirt, self.number)[1:]
        pointers = list(map(self._pointer, [self.parameters, *inputs, *outputs, work]))
        if not spare:
            pointers[0] = None if self.model.scene.baked else pointers[0]
            pointers[-1] = pointers[-1] if work.size else None
        assert self.library[f"{self.model.name}_{name}"](*pointers) == status
        assert all(np.array_equal(x, y, equal_nan=True) for x, y in zip(inputs, given, strict=True))
        return {a["name"]: values for a, values in zip(entry["outputs"], outputs, strict=True)}


@cache
def library_of(model, *flags):
    """Return the library of a model, compiled with these flags."""
    return Library(model, *flags)


def states_of(model, count=2):
    """Every argument of every function by name, of a few random states."""
    rng, functions = np.random.default_rng(2), model.manifest["functions"].values()
    sizes = {a["name"]: np.prod(a["shape"], dtype=int) for f in functions for a in f["inputs"]}
    return [
        {name: rng.uniform(0.1, 1, size) for name, size in sizes.items()}
        | dict(zip(("q", "v", "v_dot", "tau"), state, strict=True))
        for state in zip(*random_states(model.scene.segments, 5, count, "random"), strict=True)
    ]


def bits(outputs):
    """The bytes of every output."""
    return {name: values.tobytes() for name, values in outputs.items()}

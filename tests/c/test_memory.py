"""Emitted C on blocks of exactly the size that it asks for, at ordinary states and far from them:
sanitizers and valgrind find nothing, and would find what is put in.
"""

import os
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest

import serpentail as st
from checks.stress import memory
from tests.support import toolchains, zoo
from tests.support.compile_once import compile_once
from tests.support.models import folder_of

from .target.emitted import model_of, run

FAULTS = {
    "cast": "const volatile int turns = (int)q[7];\n  (void)turns;",
    "bounds": "const volatile real beyond = q[9];\n  (void)beyond;",
    "unwritten": "volatile real lost[1];\n  if (lost[0] > 0) {\n    return 0;\n  }",
}


def tool(name):
    """A compiler, and what its programs run under; skip, or fail in CI, where it is missing."""
    if name == "watched":
        toolchains.valgrind()
        return memory.PLAIN, memory.WATCHED
    if name == "followed":  # reads of what was never written
        toolchains.clang()
        return memory.FOLLOWED, ()
    return memory.SANITIZED, ()


def report_of(of, tmp_path, name, cases):
    """Run a model's cases under a tool; return them, the answers and what the tool says."""
    (compiler, under), found = tool(name), memory.every(of, 1)[cases]
    return found, *memory.answers(memory.built(of, tmp_path, *compiler), found, *under)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "of"),
    [
        *(("sanitized", "small"), ("watched", "small"), ("followed", "small")),
        *(("sanitized", "ground_m1_n1"), ("watched", "ground_m1_n1")),
    ],
)
def test_nothing_is_found(tmp_path, name, of):
    model = st.load(zoo.folder(of), compiled=False)
    found, told, report = report_of(model, tmp_path, name, slice(None))
    assert report == "" and memory.insane(found, told) == []
    # answered, refused, and runs that ended early
    assert len({answer.status for answer in told}) >= 4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "fault", "words"),
    [
        ("sanitized", "cast", "is outside the range of representable values of type 'int'"),
        ("sanitized", "bounds", "heap-buffer-overflow"),
        ("watched", "bounds", "Invalid read of size"),
        ("watched", "unwritten", "depends on uninitialised"),
        ("followed", "unwritten", "use-of-uninitialized-value"),
    ],
)
def test_what_is_put_in_is_found(tmp_path, name, fault, words):
    folder = shutil.copytree(zoo.folder("small"), tmp_path / "copy" / "small")
    of, source = st.load(folder, compiled=False), folder / "src" / "small.c"
    head = r"(int small_mass_matrix\([^)]*\)\n{\n)"
    text, count = re.subn(head, rf"\1  {FAULTS[fault]}\n", source.read_text())
    source.write_text(text)
    assert count == 1 and words in report_of(of, tmp_path, name, slice(200))[2]


def test_answers_that_are_not_sane_are_told():
    found = [memory.Case("energy", b"", memory.BATCH, refused) for refused in (True, False, False)]
    told = [memory.Answer(0, True), memory.Answer(0, False), memory.Answer(7, True)]
    assert len(memory.insane(found, told)) == 3
    assert memory.insane(found, told[:1])[0] == "1 answers to 3 cases"
    assert memory.insane(found[1:], [memory.Answer(0, True), memory.Answer(2, False)]) == []


# Ordinary states, and what the drivers above do not call: CasADi's functions, steps side by side

SANITIZED = (
    *("-std=c99", "-g", "-O0", "-fsanitize=address,undefined,float-divide-by-zero"),
    "-fno-sanitize-recover=all",
)
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
  return status;
}
"""
CASADI_DRIVER = """
typedef const long long *sizes(long long);
typedef const char *names(long long);

static int external(int (*f)(const real **, real **, long long *, real *, int),
                    int (*work)(long long *, long long *, long long *, long long *),
                    sizes *in, names *name,
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
  return status;
}
"""
STEPS = """  {
    enum { COUNT = 11, SIZE = sizeof(@_parameters) / sizeof(real) };
    @_parameters parameters;
    @_default_parameters(&parameters);
    real *own = heap(COUNT * SIZE, 0), *q = heap(COUNT * @@_NQ, 1), *v = heap(COUNT * @@_NV, 1);
    real *bristles = heap(COUNT * 2 * @@_CONTACTS, 0), *torques = heap(@@_NT, 0);
    real *legs = heap(COUNT * 8, 1), *work = heap(@WORK, 1);
    for (int k = 0; k < COUNT; ++k) {
      memcpy(own + k * SIZE, &parameters, sizeof parameters);
      q[k * @@_NQ + 2] = (real)0.01 * (real)k; /* some touch the ground, some do not */
    }
    @_ground steps = { 0 };
    steps.parameters = own;
    steps.q = q;
    steps.v = v;
    steps.bristles = bristles;
    steps.torques = torques;
    steps.legs = legs;
    steps.legs_apart = 8;
    steps.count = COUNT;
    steps.h = (real)0.00001;
    steps.steps = 2;
    steps.work = work;
    bad += @_side_by_side_ground(&steps) != 0 || steps.first != COUNT;
  }
"""


def driver(model):
    """C text that calls every function of a model on exact-sized heap blocks."""
    text, calls = DRIVER, ""
    for name, entry in model.manifest["functions"].items():
        lengths = [int(np.prod(a["shape"])) for a in (*entry["inputs"], *entry["outputs"])]
        counts = f"{len(entry['inputs'])}, {len(entry['outputs'])}"
        lengths = f"(const int[]){{ {', '.join(map(str, lengths))} }}"
        calls += f"  bad += {unless_random(name)}(call(@_batch_{name}, {counts}, {lengths}, "
        calls += f"@@_WORK_{name.upper()}) != 0);\n"
    for c in re.findall(r"^int (\w+)\(const real \*\*arg.*;$", model.host.read_text(), re.M):
        calls += f"  bad += {unless_random(c)}(external({c}, {c}_work, {c}_sparsity_in, "
        calls += f"{c}_name_in, {c}_sparsity_out) != 0);\n"
    if model.scene.real == "double":
        text += CASADI_DRIVER
    if model.scene.contacts:
        text = f'#include "@_ground.c"\n#include <string.h>\n{text}'
        calls += STEPS.replace("@WORK", str(model.manifest["ground"]["work"]))
    text += f"\nint main(void)\n{{\n  int bad = 0;\n{calls}"
    text += '  printf("%d bad\\n", bad);\n  return bad;\n}\n'
    return text.replace("@@", model.name.upper()).replace("@", model.name)


def unless_random(name):
    """Damping at random is below zero, too, and its matrix then not positive definite."""
    return "0 * " if "implicit_factor" in name else ""


def built(model, tmp_path, text):
    """Return the program of a driver's text, for one model alone."""
    main, program = tmp_path / "main.c", tmp_path / "main"
    main.write_text(text)
    command = ("gcc", *SANITIZED, "-c")
    made = compile_once(f"{model.name}.o", command, [model.source], model.include)
    places = ("-I", model.include, "-I", model.host.parent)
    run("gcc", *SANITIZED, *places, main, made, "-o", program, "-lm")
    return program


@pytest.mark.parametrize(
    "name",
    ["bare"]
    + [
        pytest.param(n, marks=pytest.mark.slow) for n in ("small", "m1_n1", "ground_m1_n1", "polar")
    ],
)
def test_sanitizers_find_nothing(tmp_path, name):
    model = model_of(name)
    program = built(model, tmp_path, driver(model))
    # what is emitted never allocates: the blocks are the driver's
    assert run(program, env={"ASAN_OPTIONS": "detect_leaks=0"}) == "0 bad\n"


def test_sanitizers_would_find_a_short_workspace(tmp_path):
    model = model_of("bare", emission="loops")  # whose workspace is not empty
    needed = "BARE_WORK_FORWARD_DYNAMICS"
    # less a vector: that much of the last row of a matrix to factor is room
    text = driver(model).replace(f"{needed})", f"{needed} - 8)")
    program = built(model, tmp_path, text)
    done = subprocess.run([program], capture_output=True, text=True, check=False)
    assert done.returncode != 0 and "heap-buffer-overflow" in done.stderr


FLIGHTS = """
import sys, numpy as np, serpentail as st
from serpentail.simulation.runs import batch
batch.worth_lanes = lambda *_: True
model = st.load(sys.argv[1])
q, v = np.zeros((11, model.nq)), np.zeros((11, model.nv))
q[:, 3], v[:, 3:] = 1, np.arange(11)[:, None]
how = {"t_span": 0.1, "output_step": 0.0123, "controller": st.Damping(1e-6)}
for method in ({"method": "tsit5"}, {"method": "rk4", "step": 1e-3}):
    found = st.simulate(model, q, v, **how, **method)
    assert found.info["abreast"] == 8 and found.errors == [None] * 11
"""


def test_flights_side_by_side_keep_to_their_memory(tmp_path):
    """In Python, by a library that is sanitized."""
    found = [run("gcc", f"-print-file-name=lib{n}.so").strip() for n in ("asan", "ubsan")]
    own = {"CC": f"gcc {' '.join(SANITIZED[3:])}", "LD_PRELOAD": ":".join(found)}
    own |= {"SERPENTAIL_CACHE": str(tmp_path), "ASAN_OPTIONS": "detect_leaks=0"}
    wanted = ["forward_dynamics", "energy", "momentum", "rollout"]
    folder = folder_of(zoo.scene("bare", functions=wanted))
    run(sys.executable, "-c", FLIGHTS, folder, env=os.environ | own)

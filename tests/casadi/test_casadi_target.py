"""The CasADi module: it stands alone, its functions say what they take, and they compute what the C
computes.
"""

import importlib.util
import json
import subprocess
import sys
from types import SimpleNamespace

import casadi
import mpmath
import numpy as np
import pytest

from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.plain import FUNCTIONS
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.pipeline import tail_of
from serpentail_codegen.scene.parse import parse_scene
from serpentail_codegen.scene.signatures.table import DERIVATIVES
from tests.references.parameters import random_states
from tests.support.compile_once import compile_once
from tests.support.models import model_folder

TAILS = {"m1_n1": (1, 1), "m2_n2": (2, 2), "arcs2": (2, None)}
SHAPES = {
    "mass_matrix": (["q"], {"H": "nv nv"}),
    "bias_force": (["q", "v"], {"force": "nv 1"}),
    "inverse_dynamics": (["q", "v", "v_dot"], {"force": "nv 1"}),
    "forward_dynamics": (["q", "v", "tau"], {"v_dot": "nv 1"}),
    "forward_dynamics_external": (["q", "v", "tau", "f_ext"], {"v_dot": "nv 1"}),
    "energy": (["q", "v"], {"kinetic": "1 1", "potential": "1 1"}),
    "momentum": (["q", "v"], {"linear": "3 1", "angular": "3 1"}),
    "center_of_mass": (["q", "v"], {"position": "3 1", "velocity": "3 1", "J": "3 nv"}),
    "tail_points": (["q"], {"points": "points 3"}),
    "tail_point_jacobians": (["q"], {"J": "rows nv"}),
    "mass_matrix_world": (["q"], {"H": "nv nv"}),
    "bias_force_world": (["q", "v"], {"force": "nv 1"}),
}
every_function = pytest.mark.parametrize("function", SHAPES)


def load(path):
    """Import a module from its file."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Model(SimpleNamespace):
    """A generated folder, its CasADi module, and states to evaluate at."""

    def __init__(self, segments, links, **options):
        self.folder = model_folder(segments, links, **options)
        self.name, self.path = self.folder.name, self.folder / f"{self.folder.name}_casadi.py"
        self.module = load(self.path)
        self.manifest = json.loads((self.folder / "manifest.json").read_text())
        self.scene = parse_scene(self.manifest["scene"], self.name)
        total = self.manifest["dimensions"]["total"]
        self.lengths = self.manifest["dimensions"] | {
            "points": total + 1,
            "rows": 3 * (total + 1),
            "1": 1,
            "3": 3,
        }
        fields = [p["name"] for p in self.manifest["parameters"] if p["in_struct"]]
        self.parameters = {name: np.ravel(self.scene.parameters[name]).tolist() for name in fields}
        q, v, v_dot, tau = (rows.T for rows in random_states(self.scene.segments, 8, 3, "random"))
        f_ext = np.random.default_rng(6).uniform(-1, 1, (6 + 3 * (total + 1), 3))
        self.states = {"q": q, "v": v, "v_dot": v_dot, "tau": tau, "f_ext": f_ext}
        self.vector = casadi.DM([x for values in self.parameters.values() for x in values])

    def inputs(self, function, state=0):
        """The inputs of a function at one state, by name, parameters included."""
        return {name: self.states[name][:, state] for name in SHAPES[function][0]} | {
            "parameters": self.vector
        }

    def shape(self, text):
        """Rows and columns of a shape in SHAPES."""
        return tuple(self.lengths[word] for word in text.split())

    def external(self, function):
        """A compiled function."""
        return casadi.external(f"{self.name}_casadi_{function}", str(self.library))

    @property
    def library(self):
        """The shared library of the model and its host entries, compiled once."""
        sources = [self.folder / "src" / f"{self.name}{part}.c" for part in ("", "_host")]
        command = ("gcc", "-std=c99", "-fPIC", "-shared")
        return compile_once("model.so", command, sources, self.folder / "include")


@pytest.fixture(
    scope="module", params=["m1_n1", pytest.param("m2_n2", marks=pytest.mark.slow), "arcs2"]
)
def model(request):
    """A generated model."""
    functions = [*SHAPES, "rollout", "forward_dynamics_derivatives"]
    return Model(*TAILS[request.param], functions=functions)


def full(outputs):
    """Outputs of a call as arrays."""
    return {name: np.array(values) for name, values in outputs.items()}


def assert_close(found, expected, tolerance=1e-12):
    """Every output agrees, relative to its largest entry in each row."""
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        scale = np.max(np.abs(values), axis=1, keepdims=True) + 1e-300
        assert np.max(np.abs(found[name] - values) / scale) <= tolerance, name


def test_module_needs_casadi_and_nothing_else(model):
    script = (
        "import sys; sys.modules |= dict.fromkeys(['serpentail', 'serpentail_codegen', 'sympy', "
        "'scipy', 'jinja2'])\n"
        f"sys.path.insert(0, {str(model.folder)!r}); import {model.name}_casadi as module\n"
        "f = module.function('mass_matrix'); print(f.n_in(), f.n_out())"
    )
    done = subprocess.run(
        [sys.executable, "-I", "-c", script], capture_output=True, text=True, check=False
    )
    assert (done.stdout, done.stderr) == ("2 1\n", "")


def test_module_has_every_function(model):
    assert (
        set(model.module.SIGNATURES)
        == set(SHAPES)
        == set(model.manifest["functions"]) - set(DERIVATIVES)
    )
    assert {
        name: len(values) for name, values in model.parameters.items()
    } == model.module.PARAMETERS


@every_function
def test_inputs_and_outputs_are_named_and_shaped_as_documented(model, function):
    inputs, outputs = SHAPES[function]
    lengths = [(len(model.states[name]), 1) for name in inputs]
    shapes = {name: model.shape(text) for name, text in outputs.items()}
    for f in (model.module.function(function), model.external(function)):
        assert f.name_in() == [*inputs, "parameters"]
        assert [f.size_in(name) for name in f.name_in()] == [*lengths, model.vector.shape]
        assert f.name_out() == list(outputs)
        assert {name: f.size_out(name) for name in outputs} == shapes
    folded = model.module.function(function, model.parameters)
    assert folded.name_in() == inputs
    assert {name: folded.size_out(name) for name in outputs} == shapes


def interpreted(model, function, arguments, algebra):
    """Run a function's program on numbers, matrices row-major; return its outputs by name."""
    p = assemble(FUNCTIONS[function], tail_of(model.scene))
    arrays = (*p.of_role("parameters"), *p.of_role("input"))
    return Run(
        p, algebra, {a.name: [algebra.convert(x) for x in arguments[a.name]] for a in arrays}
    ).values


@every_function
def test_sx_and_compiled_c_compute_what_the_program_means(model, function):
    for state in range(3):
        inputs = model.inputs(function, state)
        arguments = model.parameters | {
            name: model.states[name][:, state] for name in SHAPES[function][0]
        }
        values = interpreted(model, function, arguments, Numbers())
        shapes = {name: model.shape(text) for name, text in SHAPES[function][1].items()}
        expected = {name: np.array(values[name]).reshape(shape) for name, shape in shapes.items()}
        assert_close(full(model.external(function)(**inputs)), expected)
        assert_close(full(model.module.function(function)(**inputs)), expected)
        del inputs["parameters"]
        assert_close(full(model.module.function(function, model.parameters)(**inputs)), expected)


def test_parameters_can_be_changed_in_a_call_and_not_once_folded(model):
    inputs = model.inputs("energy")
    inputs["parameters"] = 2 * model.vector  # gravity is the first
    doubled = {name: [2 * x for x in values] for name, values in model.parameters.items()}
    del (free := dict(inputs))["parameters"]
    found = full(model.module.function("energy")(**inputs))
    assert_close(full(model.module.function("energy", doubled)(**free)), found)
    assert not np.allclose(
        found["kinetic"], full(model.module.function("energy", model.parameters)(**free))["kinetic"]
    )
    with pytest.raises(KeyError, match="torso_mass"):
        model.module.function("energy", {"gravity": 9.8})


@pytest.mark.parametrize("source", ["symbolic", "external"])
def test_map_is_one_state_after_another(model, source):
    f = (
        model.module.function("forward_dynamics")
        if source == "symbolic"
        else model.external("forward_dynamics")
    )
    names = SHAPES["forward_dynamics"][0]
    mapped = np.array(
        f.map(3)(*(model.states[name] for name in names), casadi.repmat(model.vector, 1, 3))
    )
    for state in range(3):
        one = np.array(f(**model.inputs("forward_dynamics", state))["v_dot"])
        np.testing.assert_array_equal(mapped[:, [state]], one)


@mpmath.workdps(60)
def central_differences(model, function, output, name):
    """d(output)/d(name), to about 30 digits."""
    mp = Numbers(mpmath.mp, mpmath.mpf)
    at = model.parameters | {key: model.states[key][:, 0].tolist() for key in SHAPES[function][0]}
    step, columns = mpmath.mpf(10) ** -20, []
    for k, x in enumerate(at[name]):
        ends = []
        for sign in (1, -1):
            moved = [*at[name]]
            moved[k] = x + sign * step
            ends.append(interpreted(model, function, at | {name: moved}, mp)[output])
        columns.append([float((b - a) / (2 * step)) for b, a in zip(*ends, strict=True)])
    return np.array(columns).T


def test_jacobian_is_the_limit_of_differences(model):
    """dv_dot with respect to every argument and parameter, zeros included."""
    f = model.module.function("forward_dynamics")
    jacobian = f.jacobian()
    at = model.inputs("forward_dynamics")
    found = full(jacobian(**at, out_v_dot=np.zeros(f.size_out("v_dot"))))
    parameters = [
        central_differences(model, "forward_dynamics", "v_dot", name) for name in model.parameters
    ]
    expected = {
        name: central_differences(model, "forward_dynamics", "v_dot", name)
        for name in ("q", "v", "tau")
    }
    expected["parameters"] = np.hstack(parameters)
    assert_close(found, {f"jac_v_dot_{name}": values for name, values in expected.items()}, 1e-10)


def test_external_reports_what_is_not_finite(model):
    inputs = model.inputs("forward_dynamics")
    inputs["q"] = np.full_like(inputs["q"], np.nan)
    with pytest.raises(RuntimeError):
        model.external("forward_dynamics")(**inputs)


def test_functions_survive_in_a_graph_and_in_code_of_casadi(model):
    f, q = model.module.function("mass_matrix"), casadi.MX.sym("q", model.lengths["nq"])
    wrapped = casadi.Function("wrapped", [q], [casadi.trace(f(q, model.vector))])
    H = np.array(f(**model.inputs("mass_matrix"))["H"])
    assert float(wrapped(model.states["q"][:, 0])) == pytest.approx(np.trace(H), rel=1e-13)


def test_text_does_not_grow_with_the_tail():
    sizes = [Model(*size).path.stat().st_size for size in ((1, 1), (3, 4), (8, 16))]
    assert max(sizes) < 80_000
    assert sizes[2] < 1.02 * sizes[1] < 1.15 * sizes[0]


def test_baked_scene_leaves_the_module_free():
    texts = []
    for baked in (False, True):
        model = Model(1, 1, baked=baked, functions=["mass_matrix"])
        texts.append(model.path.read_text().replace(model.manifest["content_hash"], ""))
    assert texts[0] == texts[1]


def test_float_model_has_no_external():
    model = Model(1, 1, real="float", functions=["mass_matrix"])
    assert (
        "casadi"
        not in (model.folder / "src" / f"{model.name}_host.c").read_text().split("*/", 1)[1]
    )
    double = Model(1, 1, functions=["mass_matrix"])
    assert "casadi_mass_matrix" in (double.folder / "src" / f"{double.name}_host.c").read_text()
    assert model.path.read_text().replace(
        model.manifest["content_hash"], ""
    ) == double.path.read_text().replace(double.manifest["content_hash"], "")

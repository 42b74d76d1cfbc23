"""The CasADi module: it stands alone, its functions say what they take, and they compute what the C
computes.
"""

import subprocess
import sys

import numpy as np
import pytest

from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.pipeline import tail_of
from tests.references.parameters import random_states
from tests.support import zoo
from tests.support.models import folder_of
from tests.support.rows import row

from .externals import model_of

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
    "mount_wrench": (["q", "v", "v_dot"], {"mount_force": "3 1", "mount_moment": "3 1"}),
    "pfl": (["q", "v", "accelerations"], {"tau": "nt 1"}),
    "tracked_dynamics": (["q", "v", "accelerations"], {"tau": "nt 1", "v_dot": "nv 1"}),
}
every_model = pytest.mark.parametrize(
    "name",
    ["m1_n1", "arcs1", *(pytest.param(n, marks=pytest.mark.slow) for n in ("m2_n2", "arcs2"))],
)


def states_of(model, count=3):
    """Arguments of functions by name, a column for each state."""
    points = model.manifest["dimensions"]["total"] + 1
    q, v, v_dot, tau = (x.T for x in random_states(model.scene.segments, 8, count, "random"))
    f_ext = np.random.default_rng(6).uniform(-1, 1, (6 + 3 * points, count))
    found = {"q": q, "v": v, "v_dot": v_dot, "tau": tau, "f_ext": f_ext}
    return found | {"accelerations": v_dot[6:]}


def shapes_of(model, function):
    """Rows and columns of the outputs of a function."""
    sizes = model.manifest["dimensions"] | {"1": 1, "3": 3}
    sizes |= {"points": sizes["total"] + 1, "rows": 3 * (sizes["total"] + 1)}
    outputs = SHAPES[function][1].items()
    return {name: tuple(sizes[word] for word in text.split()) for name, text in outputs}


def assert_close(found, expected):
    """Every output agrees, relative to its largest entry in each row."""
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        scale = np.max(np.abs(values), axis=1, keepdims=True) + 1e-300
        assert np.max(np.abs(np.array(found[name]) - values) / scale) <= 1e-12, name


def interpreted(model, function, arguments):
    """Run a function's program, matrices row-major; return its outputs by name."""
    p = assemble(CATALOGUE[function], tail_of(model.scene))
    arrays = (*p.of_role("parameters"), *p.of_role("input"))
    return Run(p, Numbers(), {a.name: list(arguments[a.name]) for a in arrays}).values


def test_module_needs_casadi_and_nothing_else():
    script = (
        "import sys; sys.modules |= dict.fromkeys(['serpentail', 'serpentail_codegen', 'sympy', "
        "'scipy', 'jinja2'])\n"
        f"sys.path.insert(0, {str(zoo.folder('bare'))!r}); import bare_casadi as module\n"
        "f = module.function('forward_dynamics'); print(f.n_in(), f.n_out())"
    )
    command = [sys.executable, "-I", "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("4 1\n", "")


@every_model
def test_functions_compute_what_the_program_means_with_the_ports_that_are_documented(name):
    """SX, the same folded, and compiled C."""
    model = model_of(name)
    assert set(model.module.SIGNATURES) == {*SHAPES}
    lengths = {name: len(values) for name, values in model.parameters.items()}
    assert lengths == model.module.PARAMETERS
    columns = states_of(model)
    for function, (names, _) in SHAPES.items():
        free = [model.module.function(function), model.external(function)]
        folded = model.module.function(function, model.parameters)
        shapes = shapes_of(model, function)
        with row(function):
            for f in (*free, folded):
                own = names if f is folded else [*names, "parameters"]
                sizes = columns | {"parameters": model.vector.full()}
                assert f.name_in() == own and f.name_out() == list(shapes)
                assert [f.size_in(key) for key in own] == [(len(sizes[key]), 1) for key in own]
                assert {key: f.size_out(key) for key in shapes} == shapes
            for k in range(3):
                state = {key: columns[key][:, k] for key in names}
                values = interpreted(model, function, model.parameters | state)
                expected = {key: np.reshape(values[key], size) for key, size in shapes.items()}
                assert_close(folded(**state), expected)
                for f in free:
                    assert_close(f(**state, parameters=model.vector), expected)


def test_missing_parameters_are_named_and_a_pivot_that_is_no_number_is_an_error():
    model = model_of("m1_n1")
    q, v, tau = (states_of(model)[key][:, 0] for key in ("q", "v", "tau"))
    with pytest.raises(KeyError, match="torso_mass"):
        model.module.function("energy", {"gravity": 9.8})
    with pytest.raises(RuntimeError):
        model.external("forward_dynamics")(np.nan * q, v, tau, model.vector)


def text_of(name, **changes):
    """The text of a model's module without its hash."""
    folder = folder_of(zoo.scene(name, **changes))
    return (folder / f"{name}_casadi.py").read_text().partition("\nimport")[2]


def test_text_does_not_grow_with_the_tail_nor_change_with_real_types_and_baking():
    sizes = [len(text_of("bare", segments=m, links=n)) for m, n in ((1, 1), (3, 4), (8, 16))]
    assert max(sizes) < 80_000 and sizes[2] < 1.02 * sizes[1] < 1.2 * sizes[0]
    assert text_of("bare") == text_of("bare", baked=True) == text_of("bare", real="float") != ""
    for real in ("double", "float"):
        host = folder_of(zoo.scene("bare", real=real)) / "src" / "bare_host.c"
        code = host.read_text().split("*/", 1)[1]
        assert ("casadi_forward_dynamics" in code) == ("casadi" in code) == (real == "double")

"""Every function: its arguments, the shapes of what it returns, and a model that has it."""

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.forms import SOUND

# arguments, then outputs: sizes by names of arguments, of x with tau, of points or by number
CALLS = {
    "mass_matrix": ("q", "v*v"),
    "bias_force": ("q v", "v"),
    "inverse_dynamics": ("q v v_dot", "v"),
    "forward_dynamics": ("q v tau", "v"),
    "forward_dynamics_external": ("q v tau f_ext", "v"),
    "energy": ("q v", "- -"),
    "momentum": ("q v", "3 3"),
    "center_of_mass": ("q v", "3 3 3*v"),
    "tail_points": ("q", "points*3"),
    "tail_point_jacobians": ("q", "points*3*v"),
    "mass_matrix_world": ("q", "v*v"),
    "bias_force_world": ("q v", "v"),
    "mount_wrench": ("q v v_dot", "3 3"),
    "forward_dynamics_derivatives": ("q v tau", "v*v v*v v*tau"),
    "forward_dynamics_parameter_derivatives": ("q v tau", "v*13"),
    "forward_dynamics_jvp": ("q v tau dq dv dtau", "v"),
    "forward_dynamics_vjp": ("q v tau multiplier", "v v tau"),
    "inverse_dynamics_derivatives": ("q v v_dot", "v*v v*v"),
    "inverse_dynamics_parameter_derivatives": ("q v v_dot", "v*13"),
    "inverse_dynamics_vjp": ("q v v_dot multiplier", "v v v"),
    "inverse_dynamics_hessian": ("q v v_dot multiplier", "v*v v*v v*v v*v"),
    "energy_derivatives": ("q v", "v v v"),
    "momentum_derivatives": ("q v", "3*v 3*v 3*v 3*v"),
    "pfl": ("q v accelerations", "tau"),
    "airborne_rates": ("x tau angular", "weights"),
    "airborne_rates_derivatives": ("x tau angular", "weights weights*given"),
    "airborne_rates_hessian": ("x tau angular weights", "weights weights*given given*given"),
}
ARGUMENTS = {name: arguments.split() for name, (arguments, _) in CALLS.items()}


NT, POINTS = 4, 5  # of the zoo's "m2_n2"
SIZES = dict.fromkeys(("v", "v_dot", "dq", "dv", "multiplier"), 6 + NT)
SIZES |= dict.fromkeys(("tau", "dtau", "accelerations"), NT)
SIZES |= {"q": 7 + NT, "f_ext": 6 + 3 * POINTS, "points": POINTS}
SIZES |= {"x": 4 + 2 * NT, "angular": 3, "weights": 7 + 2 * NT, "given": 4 + 3 * NT}


def shapes(name):
    words = [text.split("*") for text in CALLS[name][1].split()]
    return [() if each == ["-"] else tuple(SIZES.get(n) or int(n) for n in each) for each in words]


def states(count, seed=1):
    """Return arguments by name, each (count, size), the quaternions of any norm."""
    rng = np.random.default_rng(seed)
    return {name: rng.uniform(-2, 2, (count, size)) for name, size in SIZES.items()}


def state(seed=1):
    return {name: rows[0] for name, rows in states(1, seed).items()}


def call(model, name, arguments):
    method = model.forward_dynamics if name == "forward_dynamics_external" else getattr(model, name)
    result = method(*(arguments[argument] for argument in ARGUMENTS[name]))
    return result if isinstance(result, tuple) else (result,)


def assert_same(found, expected):
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one, other)


FORMS = SOUND | {
    "single": np.float32,
    "whole": lambda a: np.rint(a).astype(np.int64) + 1,
    "column": lambda a: a[:, None],
    "short": lambda a: a[..., :-1],
    "long by one": lambda a: np.append(a, 0.0),
    "scalar": lambda _: np.float64(1.0),
    "nan": lambda a: np.where(np.arange(a.shape[-1]) == 1, np.nan, a),
    "infinite": lambda a: np.where(np.arange(a.shape[-1]) == 1, -np.inf, a),
    "zero": np.zeros_like,
    "huge": lambda a: 1e200 * a.astype(float),
    "complex": lambda a: a + 0j,
    "none": lambda _: None,
}


@pytest.fixture(scope="module")
def model():
    """A model with every function, whose batches nobody else has compiled in this process."""
    return st.load(zoo.folder("m2_n2"))

"""Derivatives by other means: states, a complex step through the loops of a function, and an error
measure.
"""

from functools import cache
from math import pi

import numpy as np

from serpentail_codegen.functions.catalogue import function_of
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.ir.dataflow import inlined
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.pipeline import tail_of
from serpentail_codegen.scene.parse import parse_scene
from tests.references.metrics import BLOCKS
from tests.references.parameters import random_states

COMPLEX = Numbers(np, complex)
STEP = 1e-30  # of the imaginary part: without a subtraction, derivatives are as exact as values
# part of the largest derivative in the same rows: smaller blocks are compared with that
NEGLIGIBLE = 1e-6
KINDS = ("random", "straight", "folded", "still", "scaled")


def _of(output, *arguments):
    """Derivatives of one of several outputs: their names, and what is differentiated by what."""
    return {f"{output}_d{argument}": (output, argument) for argument in arguments}


def _alone(output, *arguments):
    """Derivatives of a function's only output."""
    return {f"d{argument}": (output, argument) for argument in arguments}


# for every derivative function: the differentiated one, and for its outputs (output, argument)
FIRST = {
    "inverse_dynamics_derivatives": ("inverse_dynamics", _alone("force", "q", "v")),
    "forward_dynamics_derivatives": ("forward_dynamics", _alone("v_dot", "q", "v", "tau")),
    "inverse_dynamics_parameter_derivatives": ("inverse_dynamics", _alone("force", "parameters")),
    "forward_dynamics_parameter_derivatives": ("forward_dynamics", _alone("v_dot", "parameters")),
    "energy_derivatives": ("energy", _of("kinetic", "q", "v") | _of("potential", "q")),
    "momentum_derivatives": ("momentum", _of("linear", "q", "v") | _of("angular", "q", "v")),
}


def states(model, kind, count=2):
    """States of a kind: q, v, v_dot, tau, multiplier by name; folded arcs are bent by pi."""
    m, tails = model.segments, kind if kind in ("random", "straight", "folded") else "random"
    q, v, v_dot, tau = random_states(m, 23, count, tails)
    if kind == "folded":
        bends = q[:, 7:].reshape(count, m, 2)
        arcs = np.array(model.kinds) == "continuum"
        bends[:, arcs] *= pi / np.linalg.norm(bends[:, arcs], axis=2, keepdims=True)
    q[:, 3:7] *= 3.7 if kind == "scaled" else 1
    v *= 0 if kind == "still" else 1
    multiplier = random_states(m, 29, count, "random")[1] / np.repeat([2, 20, 10], [3, 3, 2 * m])
    first, count = 6 * model.fixed, model.nv  # without a torso, the tail's numbers alone
    own = slice(first, first + count)
    found = (q[:, first and 7 :][:, : model.nq], *(x[:, own] for x in (v, v_dot)))
    found += (tau[:, : model.layout.nt], multiplier[:, own])
    return [
        dict(zip(("q", "v", "v_dot", "tau", "multiplier"), x, strict=True))
        for x in zip(*found, strict=True)
    ]


def of_every_kind(model):
    """All states of all kinds, each with its name."""
    return [(f"{kind} {k}", x) for kind in KINDS for k, x in enumerate(states(model, kind))]


def tangent_of_q(q, nv):
    """Rates of q (..., nq, nv) when it moves with the unit velocities: of the quaternion, q * (0,
    omega) / 2.
    """
    T = np.zeros((*q.shape, nv))
    if nv == q.shape[-1]:
        return T + np.eye(nv)
    w, x, y, z = np.moveaxis(q[..., 3:7], -1, 0) / 2
    T[..., :3, :3], T[..., 7:, 6:] = np.eye(3), np.eye(nv - 6)
    for row, entries in enumerate([(-x, -y, -z), (w, -z, y), (z, w, -x), (-y, x, w)]):
        for column, entry in enumerate(entries):
            T[..., 3 + row, 3 + column] = entry
    return T


@cache
def nest_of(model, function):
    """Return the loop nest of a model's function, with called programs inlined."""
    scene = parse_scene(model.manifest["scene"], model.name)
    tail = tail_of(scene)
    return inlined(assemble(function_of(function, tail), tail))


def parameters_of(model):
    """The parameters of a model's functions by name."""
    sizes = {a.name: a.length for a in nest_of(model, "mass_matrix").of_role("parameters")}
    return dict(
        zip(sizes, np.split(model.parameter_vector, np.cumsum([*sizes.values()])[:-1]), strict=True)
    )


def complex_step(model, function, state, argument):
    """Derivatives of the outputs of a function with respect to one argument: name -> (states,
    length, directions); the arguments in ``state`` are stacks of states.
    """
    nest, parameters = nest_of(model, function), parameters_of(model)
    vectors = parameters | {a.name: state[a.name] for a in nest.of_role("input")}
    if argument == "parameters":
        unit = iter(np.eye(len(model.parameter_vector)))
        directions = {name: np.array([next(unit) for _ in x]) for name, x in parameters.items()}
    else:
        x = state[argument]
        tangents = tangent_of_q(x, model.nv) if argument == "q" else np.eye(x.shape[-1])
        directions = {argument: tangents}
    shape = (len(state["q"]), next(iter(directions.values())).shape[-1])
    scalars = {}
    for name, x in vectors.items():
        steps = directions.get(name, np.zeros((x.shape[-1], shape[1])))
        scalars[name] = [x[..., k, None] + 1j * STEP * steps[..., k, :] for k in range(x.shape[-1])]
    run = Run(nest, COMPLEX, scalars)
    return {
        a.name: np.stack([np.broadcast_to(x, shape).imag for x in run.values[a.name]], axis=1)
        / STEP
        for a in nest.of_role("output")
    }


def spans(size, nv):
    """Blocks of rows or columns with the same unit."""
    return BLOCKS if size == nv else (slice(None),)


def jacobian_error(found, expected, nv, negligible=NEGLIGIBLE):
    """Return the largest max|d| / max|ref| over blocks; a block that is negligible in its rows is
    scaled by them.
    """
    found, expected = np.atleast_2d(found), np.atleast_2d(expected)
    assert found.shape == expected.shape
    worst = 0.0
    for rows in spans(len(expected), nv):
        floor = negligible * np.max(np.abs(expected[rows]), initial=0) or 1.0
        for columns in spans(expected.shape[1], nv):
            one, other = found[rows, columns], expected[rows, columns]
            scale = max(np.max(np.abs(other), initial=0), floor)
            worst = max(worst, np.max(np.abs(one - other), initial=0) / scale)
    return worst


def parameter_scales(model):
    """Return the magnitude of each parameter, so that its derivatives are forces; a zero has the
    magnitude of its vector.
    """
    return np.concatenate(
        [np.full(len(part), np.abs(part).max()) for part in parameters_of(model).values()]
    )

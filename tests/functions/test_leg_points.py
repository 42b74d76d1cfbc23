"""The joints of both legs: those of the pictures, and A, M and T of the contact's reference."""

import math
from types import SimpleNamespace

import numpy as np

from serpentail.pictures.skeleton import leg_joints
from serpentail_codegen.functions.contact import assemble_leg_points
from serpentail_codegen.functions.function import Function, assemble
from serpentail_codegen.functions.tail import Tail, struct_parameters
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.scene.signatures.arguments import LEGS, Argument, Q
from tests.references.contact import attitude, feet

FLOATS = Numbers(math, float)
TAIL = Tail(1, 1, contacts=("feet",))
JOINTS = Argument("joints", (2, 6, 3), "joints of both legs (m, world)")
FUNCTION = Function("leg_points", "Joints of both legs.", (Q, LEGS), (JOINTS,), assemble_leg_points)


def test_joints_of_both_legs():
    rng = np.random.default_rng(3)
    parameters = {p.name: p.default for p in struct_parameters(TAIL)}
    program = assemble(FUNCTION, TAIL)
    flat = {p.name: np.ravel(parameters[p.name]) for p in struct_parameters(TAIL)}
    names = {array.name for array in program.of_role("parameters")}
    for _ in range(5):
        q, legs = rng.normal(size=TAIL.nq), rng.normal(size=8)
        values = {name: list(flat[name]) for name in names} | {"q": list(q), "legs": list(legs)}
        found = np.reshape(Run(program, FLOATS, values).values["joints"], (2, 6, 3))
        q[3:7] /= np.linalg.norm(q[3:7])
        motion = SimpleNamespace(q=q[None], attitude=q[None, 3:7])
        drawn = leg_joints(SimpleNamespace(parameters=parameters), motion, legs[None, :4])
        np.testing.assert_allclose(found, drawn[0], rtol=0, atol=1e-14)
        points = q[:3] + np.array(feet(parameters, legs)) @ attitude(q[3:7]).T
        np.testing.assert_allclose(found[:, 3:].reshape(6, 3), points, rtol=0, atol=1e-14)

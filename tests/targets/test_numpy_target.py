"""The recipe for a target: the NumPy target that follows it means what the programs mean."""

import json
from dataclasses import replace

import numpy as np
import pytest

from serpentail_codegen import pipeline
from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.ir.program import STATEMENTS
from serpentail_codegen.scene.parse import scene_for
from tests.references.parameters import random_states
from tests.support.rows import row
from tests.targets.numpy_target import TARGET, NumpyPrinter
from tests.targets.test_targets import printed_kinds

VALUES = ["mass_matrix", "forward_dynamics", "energy", "tail_points"]
DERIVATIVES = ["forward_dynamics_derivatives", "inverse_dynamics_hessian", "inverse_dynamics_vjp"]
SCENES = {
    "one_link": scene_for("articulated", 1, 1, functions=[*VALUES, *DERIVATIVES]),
    "links": scene_for("articulated", 2, 3, functions=[*VALUES, *DERIVATIVES, "implicit"]),
    "arcs": scene_for("continuum", 2, functions=[*VALUES, "inverse_dynamics_derivatives", "pfl"]),
    "feet": scene_for(
        "articulated", 1, 2, contacts=["feet", "tail"], functions=["contact_dynamics", "implicit"]
    ),
}


def emitted(scene, root):
    """The manifest of a scene's model in NumPy alone, and the names that its module defines."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(pipeline.TARGETS, "numpy", TARGET)
        pipeline.generate(replace(scene, targets=("numpy",)), root)
    folder, names = root / scene.name, {}
    exec((folder / f"{scene.name}_numpy.py").read_text(), names)
    return json.loads((folder / "manifest.json").read_text()), names


def arguments_of(scene, function, tail):
    """A random state; positive numbers for all other arguments."""
    q, v, v_dot, tau = (rows[0] for rows in random_states(scene.segments, 5, 1, "random"))
    known, rng = {"q": q, "v": v, "v_dot": v_dot, "tau": tau}, np.random.default_rng(7)
    return {
        a.name: known[a.name] if a.name in known else rng.uniform(0.1, 0.3, a.length(tail))
        for a in function.inputs
    }


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_emitted_module_computes_what_the_programs_mean(scene, tmp_path):
    manifest, names = emitted(scene, tmp_path)
    assert names["__doc__"].endswith(f"derivation {manifest['content_hash']}.")
    assert manifest["scene"]["targets"] == ["numpy"] and "work" not in manifest
    tail = pipeline.tail_of(scene)
    parameters = {key: np.ravel(value).tolist() for key, value in scene.parameters.items()}
    for name in manifest["functions"]:
        function = CATALOGUE[name].of(tail)
        program, arguments = assemble(function, tail), arguments_of(scene, function, tail)
        arrays = (*program.of_role("parameters"), *program.of_role("input"))
        given = {a.name: (parameters | arguments)[a.name] for a in arrays}
        expected = Run(program, Numbers(), given).values
        found = names[name](parameters, **arguments)
        with row(name):
            assert list(found) == [a.name for a in function.outputs]
            for key, values in found.items():
                wanted = np.array(expected[key], float)
                limit = 1e-10 * np.max(np.abs(wanted))
                np.testing.assert_allclose(values, wanted, rtol=0, atol=limit, err_msg=key)


def test_numpy_prints_every_statement():
    assert printed_kinds(NumpyPrinter) == set(STATEMENTS)

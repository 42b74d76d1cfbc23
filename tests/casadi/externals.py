"""Models of the zoo in CasADi: the generated module, the compiled functions, and states of both."""

import importlib.util
from functools import cache

import casadi
import numpy as np

from serpentail_scene.signatures.table import EXACT_DERIVATIVES
from tests.references.parameters import random_states
from tests.support import slopes, zoo

LAST = {"inverse_dynamics": "v_dot", "forward_dynamics": "tau"}
KINDS = ("random", "straight", "folded")
assert LAST.keys() == EXACT_DERIVATIVES.keys()


class Model:
    """A model of the zoo, its CasADi module, and states to evaluate at."""

    def __init__(self, name):
        self.name, self.folder, self.loaded = name, zoo.folder(name), zoo.model(name)
        self.path, self.scene = self.folder / f"{name}_casadi.py", zoo.scene(name)
        spec = importlib.util.spec_from_file_location(self.path.stem, self.path)
        self.module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(self.module)
        self.manifest, self.library = self.loaded.manifest, self.loaded.library._name
        fields = [p["name"] for p in self.manifest["parameters"] if p["in_struct"]]
        self.parameters = {name: np.ravel(self.scene.parameters[name]).tolist() for name in fields}
        self.vector = casadi.DM([x for values in self.parameters.values() for x in values])

    def external(self, function):
        """A compiled function, as CasADi loads it."""
        return casadi.external(f"{self.name}_casadi_{function}", self.library)

    def pair(self, function, kind):
        """A derivative of the compiled function, and of the SX function."""
        both = (self.external(function), self.module.function(function))
        return [slopes.derivatives(f)[kind] for f in both]

    def inputs(self, function, state):
        """The inputs of a function at a state (q, v, v_dot, tau), parameters included."""
        found = dict(zip(("q", "v", "v_dot", "tau"), state, strict=True))
        return {key: found[key] for key in ("q", "v", LAST[function])} | {"parameters": self.vector}

    def states(self):
        """States by name: each kind of tail, one at rest, one whose quaternion has another norm."""
        rows = {
            kind: [x[0].copy() for x in random_states(self.scene.segments, 3, 1, kind)]
            for kind in KINDS
        }
        q, v, *others = rows["random"]
        rows["still"] = [q, 0 * v, *others]
        rows["long"] = [np.r_[q[:3], 1.7 * q[3:7], q[7:]], v, *others]
        return rows


@cache
def model_of(name):
    """Return a model of the zoo, with its module loaded once."""
    return Model(name)

"""Derivatives of CasADi functions; run as a program, it compares a compiled model with its module.

It needs only casadi and numpy.
"""

import sys

import casadi
import numpy as np


def derivatives(f):
    """Return the Jacobian, the adjoint and the adjoint's Jacobian of a function."""
    return {"jac": f.jacobian(), "adj1": f.reverse(1), "jac_adj1": f.reverse(1).jacobian()}


def difference(a, b):
    """Return the largest difference of two matrices, relative to the second's largest entry."""
    a, b = (np.array(casadi.DM(x)) for x in (a, b))
    return np.max(np.abs(a - b), initial=0) / (np.max(np.abs(b), initial=0) + 1e-300)


def blocks(f, at):
    """Return the outputs of a derivative that do not concern the parameters, as sparse matrices by
    name.
    """
    seeds = {name: np.sin(1 + np.arange(f.numel_in(name))) for name in f.name_in()}
    found = f(**{name: at.get(name, seed) for name, seed in seeds.items()})
    return {name: casadi.DM(value) for name, value in found.items() if "parameters" not in name}


def main(module_folder, module_name, library, parameters):
    """Compare the compiled functions with those of the module; print what differs."""
    sys.path.insert(0, module_folder)
    module, bad = __import__(module_name), []
    parameters = casadi.DM([float(x) for x in parameters.split(",")])
    for name, last in (("forward_dynamics", "tau"), ("inverse_dynamics", "v_dot")):
        prefix = module_name.removesuffix("_casadi")
        f, g = casadi.external(f"{prefix}_casadi_{name}", library), module.function(name)
        at = {key: np.cos(1 + np.arange(f.numel_in(key))) for key in ("q", "v", last)}
        at |= {"parameters": parameters} | ({"tau": 1e-3 * at["tau"]} if last == "tau" else {})
        for kind, mine in derivatives(f).items():
            theirs = blocks(derivatives(g)[kind], at)
            bad += [
                (name, kind, key)
                for key, value in blocks(mine, at).items()
                if difference(value, theirs[key]) > 1e-11
            ]
    print(f"casadi {casadi.__version__}: {bad or 'all agree'}")


if __name__ == "__main__":
    main(*sys.argv[1:])

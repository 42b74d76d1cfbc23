"""Stages of plans, called in C one by one."""

import ctypes
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

import serpentail as st
from serpentail.planning.nlp.mesh import uniform
from serpentail.planning.nlp.node import PARAMETERS
from serpentail.planning.nlp.rules import collocation_rule
from serpentail.planning.problem import PlanningProblem
from serpentail.planning.staged.fatrop import kernel
from serpentail.planning.staged.stages import stages_of
from serpentail.planning.staged.task import task_of

_numbers = ctypes.POINTER(ctypes.c_double)


class Stage(ctypes.Structure):
    """``Stage`` of native/stage.h."""

    _fields_ = (
        ("task", ctypes.c_void_p),
        *((name, ctypes.c_int) for name in ("first", "pieces", "variables", "results")),
        *((name, ctypes.c_int) for name in ("bounded", "first_bounded")),
        *((name, _numbers) for name in ("v", "z", "y", "r", "J", "factors")),
        ("pivots", ctypes.c_void_p),
        *((name, _numbers) for name in ("slopes", "Jr", "from_v", "from_z", "scratch")),
        *((name, ctypes.c_int) for name in ("known", "failed", "sloped", "factored")),
        *((name, ctypes.c_long) for name in ("node_calls", "newton_steps")),
        *((name, _numbers) for name in ("given", "mu", "H")),
        ("curved", ctypes.c_int),
    )


class Head(ctypes.Structure):
    """The first members of ``Program`` in native/ocp.h."""

    _fields_ = (("task", ctypes.c_void_p), ("stages", ctypes.POINTER(Stage)))


def problem(model, **changes) -> PlanningProblem:
    """Return a checked problem of a model at rest."""
    nt = model.layout.nt
    q = np.zeros(model.nq)
    q[3] = 1.0
    bounds = st.Bounds(np.full(nt, 1.0), None, np.full(nt, 0.02), None)
    settings = {
        "q0": q,
        "v0": np.zeros(model.nv),
        "goal": st.Goal(torso_rate=np.zeros(3)),
        "duration": (0.3, 0.5),
        "bounds": bounds,
        "objective": "effort",
        "smoothing": 3e-4,
        "damping": 0.0,
        "path": (),
        "clearance": None,
        "legs": None,
        "formulation": "airborne",
        "attitude": "quaternion",
    }
    return PlanningProblem(**settings | changes)


class OneStage:
    """The first stage of a problem from the state x (units), with results, slopes and Hessian."""

    def __init__(self, program, task):
        self.code, self.program, self.task = kernel(), program, task
        for name in ("stage_values", "stage_slopes"):
            getattr(self.code, name).argtypes = (ctypes.c_void_p, ctypes.c_void_p)
        self.code.stage_hessian.argtypes = (ctypes.c_void_p,) * 4
        self.all = ctypes.cast(program, ctypes.POINTER(Head)).contents.stages
        self.stage = self.all[0]
        self.address = ctypes.addressof(self.stage)
        self.size = self.stage.variables

    def values(self, v):
        """Return the results (r,) at v, or None if there are none."""
        v = np.ascontiguousarray(v)
        if self.code.stage_values(self.address, v.ctypes.data):
            return None
        return np.ctypeslib.as_array(self.stage.r, (self.stage.results,)).copy()

    def slopes(self, v):
        """Their Jacobian (r, v)."""
        v = np.ascontiguousarray(v)
        if self.code.stage_slopes(self.address, v.ctypes.data):
            return None
        return np.ctypeslib.as_array(self.stage.Jr, (self.stage.results, self.size)).copy()

    def hessian(self, v, mu):
        """The Hessian of mu^T results."""
        v, mu = map(np.ascontiguousarray, (v, mu))
        H = np.zeros((self.size, self.size))
        if self.code.stage_hessian(self.address, v.ctypes.data, mu.ctypes.data, H.ctypes.data):
            return None
        return H


@contextmanager
def first_stage(model, x, momentum, controls=None, degree=3, functions=None, **changes):
    """Yield the first of six intervals, or of control intervals, of a problem.

    functions: of the node, instead of the model's own.
    """
    stages = stages_of(
        model, problem(model, **changes), uniform(6, controls), collocation_rule("radau", degree)
    )
    if functions is not None:
        stages = replace(stages, node=replace(stages.node, functions=functions))
    p = np.zeros(PARAMETERS)
    p[:3], p[PARAMETERS - 1] = momentum, 1e-3
    task = task_of(stages, x, p, 1.0)
    program = kernel().program_new(ctypes.byref(task.task))
    guess = np.tile(x, (stages.mesh.intervals, degree, 1))
    kernel().program_guess(program, guess.ctypes.data)
    try:
        yield OneStage(program, task)
    finally:
        kernel().program_free(program)

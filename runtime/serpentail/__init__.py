"""Dynamics, simulations, plans and pictures of the models in generated folders."""

from importlib import import_module
from typing import Any

__version__ = "0.2.0"
_HOME = {
    "load": "model.load",
    "Model": "model.model",
    "State": "model.state",
    "build": "building.build",
    "examples": "building.examples",
    **dict.fromkeys(["progress", "Progress"], "basics.progress"),
    "simulate": "simulation.simulate",
    "Rollouts": "simulation.rollouts",
    "gradient": "simulation.gradients.loss",
    "Gradient": "simulation.gradients.gradient",
    "settle": "simulation.settle",
    "scenario": "scenes.simulate",
    "Scenario": "scenes.scenario",
    **dict.fromkeys(
        ["Damping", "TorqueTable", "TorqueCurve", "TensionTable", "TensionCurve", "Phases"],
        "simulation.controllers.controller",
    ),
    "NativeTorque": "simulation.controllers.parts",
    "Sampled": "simulation.controllers.sampled",
    "Piecewise": "simulation.controllers.piecewise",
    **dict.fromkeys(["Legs", "Reference"], "simulation.controllers.schedules"),
    "Prescribed": "simulation.controllers.prescribed",
    "Load": "simulation.controllers.load",
    "Contact": "motion.contact",
    "Trajectory": "motion.trajectory",
    "summary": "motion.summary",
    **dict.fromkeys(["momentum_shares", "MomentumShares"], "show.shares"),
    **dict.fromkeys(["compare", "Comparison"], "show.compare"),
    **dict.fromkeys(["pitch_roll_yaw", "rotation_matrix"], "basics.attitude"),
    **dict.fromkeys(["polar_to_bend", "bend_to_polar"], "model.polar"),
    "plan": "planning.planner",
    **dict.fromkeys(["Goal", "Bounds"], "planning.goal"),
    **dict.fromkeys(["Mesh", "Tolerances", "Solver", "Guess"], "planning.settings"),
    "Plan": "planning.result.plan",
    "planned": "scenes.plan",
    "Gains": "planning.gains.gains",
    "Mpc": "mpc.mpc",
    "MpcFlag": "mpc.mpc",
    "Pfl": "simulation.controllers.pfl",
    "Sequence": "sequence.sequence",
    "SequenceRun": "sequence.run",
    **dict.fromkeys(["Phase", "Tracking"], "sequence.phase"),
    "optimise": "sequence.optimise",
    "Leap": "sequence.leap",
    **dict.fromkeys(["identify"], "identification.identify"),
    "Identification": "identification.result",
    **dict.fromkeys(["Marker", "marker_positions"], "identification.placement"),
    **dict.fromkeys(["MarkerTracks", "marker_tracks"], "identification.tracks"),
    **dict.fromkeys(["read_markers", "write_markers"], "identification.marker_files"),
    "TorquePrior": "identification.torques",
    **dict.fromkeys(["joint_torques", "JointTorques"], "identification.inverse"),
    **dict.fromkeys(["fisher_information", "Information"], "identification.design"),
    "film": "show.pictures.film",
    "filmstrip": "show.pictures.filmstrip",
    "leg_joints": "show.animal",
    "plot": "show.pictures.plot",
    "view": "show.page.view",
    "live": "show.live.live",
    "export": "bridges.exporting.export",
    **dict.fromkeys(["environment", "environments"], "bridges.learning.make"),
    **dict.fromkeys(["jax_functions", "torch_functions"], "bridges.differentiable.make"),
    "sweep": "bridges.sweeps.sweep",
    "Sweep": "bridges.sweeps.result",
    **dict.fromkeys(["grid", "random", "latin", "sobol"], "bridges.sweeps.axis"),
    **dict.fromkeys(
        [
            "SerpentailError",
            "CompilerNotFound",
            "CompileFailed",
            "ModelError",
            "StateError",
            "SimulationError",
            "PlanningError",
            "IdentificationError",
            "ExtraMissing",
            "NotWritten",
            "ViewError",
            "ExportError",
            "SweepError",
            "UnlikeBodies",
            "UnusualSize",
            "DoubtfulMarkers",
        ],
        "basics.errors",
    ),
}
__all__ = list(_HOME)


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: importing the package loads nothing else."""
    if name.startswith("_"):  # of which inspect and test runners ask for many
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name not in _HOME:
        from .basics.near_names import none_such

        raise AttributeError(none_such(f"module {__name__!r} has no attribute", name, __all__))
    value = getattr(import_module(f".{_HOME[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)

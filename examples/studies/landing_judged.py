"""Common parts of kicks and jumps of the study: models, and the criterion of a landing."""

from math import radians

import numpy as np

import serpentail as st

LANDING = {"gamma": radians(230), "delta": radians(-20), "duration": 0.1}  # of the legs
SETTINGS = {"rtol": 1e-5, "output_step": 2e-3}


def model_of(options: dict) -> st.Model:
    """Return a model of this tail with all groups of contacts, and exact derivatives for its
    plans.
    """
    return st.build(**options, contacts=["feet", "tail", "torso"], purpose=["plan"])


def judged(model: st.Model, run: st.SequenceRun) -> dict:
    """Return the numbers of a landing, and whether it counts (docs/sequences.md has the
    criterion).
    """
    found, motion = st.summary(model, run.trajectory), run.trajectory
    names = ("standing_end", "landing_group", "least_upright_landing", "turned_landing_rad")
    told = {name: found[name] for name in names}
    flight = run.phases[-2]
    inside = (motion.t > flight.begin) & (motion.t < flight.end)
    told["torque_N_m"] = float(np.abs(motion.tau[inside]).max())
    told["plan_s"] = None if flight.plan is None else flight.plan.report["wall_s"]
    stands = told["standing_end"] and told["landing_group"] == "feet"
    told["lands"] = bool(
        stands and told["least_upright_landing"] > 0.5 and told["turned_landing_rad"] < 2
    )
    return told

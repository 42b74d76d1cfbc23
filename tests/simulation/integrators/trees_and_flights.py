"""Integration methods: coefficients fulfil their order conditions, and the generated loops keep
what these promise.
"""

from functools import cache

import numpy as np

import serpentail as st

from ...support.models import model_folder

WANTED = ["forward_dynamics", "energy", "momentum", "rollout", "implicit", "pfl"]


# The generated loops.


@cache
def model(segments=2, links=2):
    return st.load(model_folder(segments, links, functions=WANTED))


def start(m, seed=0):
    random = np.random.default_rng(seed)
    q, v = np.zeros(m.nq), np.zeros(m.nv)
    q[2], q[3:7] = 0.4, random.normal(size=4)
    q[7:] = random.uniform(-0.5, 0.5, m.nq - 7)
    v[:6] = random.uniform(-3, 3, 6)
    v[6:] = random.uniform(-4, 4, m.nv - 6)
    return q, v


def fly(m=None, **settings):
    m = m or model()
    return st.simulate(m, *start(m), **{"controller": st.Damping(1e-5), "t_span": 0.2} | settings)

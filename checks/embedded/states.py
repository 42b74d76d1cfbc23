"""The states on which the check of a board calls every function."""

import math

import numpy as np

# Largest |value| of each entry of an input; the last one also applies to all entries after it.
SCALES = {
    "v": (2, 2, 2, 20, 20, 20, 10),
    "v_dot": (20, 20, 20, 500, 500, 500, 500),
    "tau": (1e-3,),
    "accelerations": (500,),
    "f_ext": (0.1,),
    "bristles": (1e-3,),
}
# Smallest and largest value of inputs that are not symmetric about zero.
RANGES = {"damping": (0, 1e-3), "gains": (0, 400), "weight": (1e-4, 1e-3), "factors": (0.1, 1)}
STANDING = np.radians([210, -40, 210, -40, 0, 0, 0, 0])  # gamma, delta of both legs and their rates


def stored_states(manifest: dict, count: int = 3, seed: int = 8) -> dict[str, np.ndarray]:
    """Return (count, length) arrays by input name; every number is one that single precision holds
    too.
    """
    rng = np.random.default_rng(seed)
    states = {}
    for entry in manifest["functions"].values():
        for argument in entry["inputs"]:
            name, length = argument["name"], math.prod(argument["shape"])
            if name not in states:
                states[name] = _drawn(rng, name, (count, length)).astype(np.float32).astype(float)
    return states


def _drawn(rng: np.random.Generator, name: str, shape: tuple[int, int]) -> np.ndarray:
    if name == "q":
        return _configurations(rng, shape)
    if name == "legs":
        return STANDING + rng.uniform(-0.3, 0.3, shape)
    if name in RANGES:
        return rng.uniform(*RANGES[name], shape)
    scales = SCALES.get(name, (1,))
    return rng.uniform(-1, 1, shape) * np.array(
        [scales[min(k, len(scales) - 1)] for k in range(shape[1])]
    )


def _configurations(rng: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    """Return q close to the ground, tilted by up to about 1 rad, tail coordinates up to 1.2 rad."""
    q = rng.uniform(-1.2, 1.2, shape)
    q[:, :3] = rng.uniform(0.01, 0.03, (shape[0], 3))
    quaternions = np.array([1, 0, 0, 0]) + rng.uniform(-0.5, 0.5, (shape[0], 4))
    q[:, 3:7] = quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
    return q

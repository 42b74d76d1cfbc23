"""A small policy learns to right a falling rat by its tail, with an evolution strategy in NumPy.

2048 rats fall at once; the tilt of their backs at the end is printed as it shrinks.
"""

from __future__ import annotations  # those of serpentail would import it

import argparse
import sys

import serpentail as st

RATS, PAIRS, HIDDEN = 2048, 32, 16  # at once; mirrored pairs of policies; units of a policy
ROUNDS, SPREAD, RATE = 200, 0.2, 0.1
SCALE = [1, 1, 1, 20, 20, 20, 1, 3, 1, 1, 50, 50, 1]  # of what is seen


def actions(policies, seen):
    """Torques (P, n, 2) of policies (P, size), two layers each, for what is seen (P, n, 13)."""
    import numpy as np

    inputs, first = len(SCALE), (len(SCALE) + 1) * HIDDEN
    inner = policies[:, :first].reshape(-1, inputs + 1, HIDDEN)
    outer = policies[:, first:].reshape(-1, HIDDEN + 1, 2)
    hidden = np.tanh(seen / SCALE @ inner[:, 1:] + inner[:, :1])
    return np.tanh(hidden @ outer[:, 1:] + outer[:, :1])


def scores(worlds, policies, seed):
    """Mean reward of each policy over an episode, and tilts (deg) at the ends, from like starts."""
    import numpy as np

    each, done = worlds.num_envs // len(policies), np.zeros(worlds.num_envs, bool)
    rewards, tilts = np.zeros(worlds.num_envs), np.full(worlds.num_envs, np.nan)
    seen, _ = worlds.reset(seed=[seed + k % each for k in range(worlds.num_envs)])
    while not done.all():
        chosen = actions(policies, seen.reshape(len(policies), each, -1))
        seen, reward, ended, over, _ = worlds.step(chosen.reshape(worlds.num_envs, 2))
        rewards += np.where(done, 0, reward)
        last = (ended | over) & ~done
        tilts[last] = np.degrees(np.arccos(np.clip(seen[last, 2], -1, 1)))
        done |= last
    return rewards.reshape(-1, each).mean(axis=1), tilts


def learn(worlds, rounds=ROUNDS, seed=0):
    """Return the policy that is found, and its mean tilt (deg) in rounds; prints some of them."""
    import numpy as np

    rng = np.random.default_rng(seed)
    size = (len(SCALE) + 1) * HIDDEN + (HIDDEN + 1) * 2
    policy, mean, square, tilts = 0.1 * rng.normal(size=size), 0.0, 0.0, []
    for k in range(1, rounds + 1):
        # mirrored noise; ranks in place of rewards; a step by Adam
        noise = rng.normal(size=(PAIRS, size))
        found, tilt = scores(worlds, policy + SPREAD * np.vstack([noise, -noise]), 1000 * k)
        ranks = found.argsort().argsort() / (2 * PAIRS - 1) - 0.5
        slope = (ranks[:PAIRS] - ranks[PAIRS:]) @ noise / (PAIRS * SPREAD)
        mean, square = 0.9 * mean + 0.1 * slope, 0.99 * square + 0.01 * slope**2
        moved = (mean / (1 - 0.9**k)) / (np.sqrt(square / (1 - 0.99**k)) + 1e-8)
        policy = policy + RATE * moved
        tilts.append(float(tilt.mean()))
        if k == 1 or k % 10 == 0:
            print(
                f"round {k:3}: the backs are tilted by {tilts[-1]:5.1f} deg at the end", flush=True
            )
    return policy, tilts


def main() -> None:
    """Learn, then try the policy on starts that it has not seen."""
    import numpy as np

    rat = st.build("kangaroo_rat_m1_n3")
    worlds = st.environments(rat, "righting", RATS)
    policy, _ = learn(worlds)
    for words, tried in (("without torque", 0 * policy), ("as learned", policy)):
        tilts = scores(worlds, tried[None], 10**6)[1]
        most = np.quantile(tilts, 0.9)
        print(f"{words}: {np.mean(tilts):.1f} deg at the end, 9 of 10 below {most:.1f}")


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__).parse_args()
    try:
        with st.progress():
            main()
    except KeyboardInterrupt:
        sys.exit("interrupted: nothing is kept")

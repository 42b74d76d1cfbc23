"""
Learning to fall on the feet
============================

``st.environments`` makes many Gymnasium environments that are simulated together. A
small neural network learns to right a falling rat by its tail, with an evolution
strategy in a few lines of NumPy: try random changes of the weights, and move towards
those that earned more. This needs ``pip install "serpentail[gym]"``.
"""

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

RATS, PAIRS, HIDDEN, ROUNDS = 512, 32, 16, 60
SCALE = [1, 1, 1, 20, 20, 20, 1, 3, 1, 1, 50, 50, 1]  # of the numbers that are observed
rat = st.build("kangaroo_rat_m1_n3", functions=["forward_dynamics", "rollout"])
worlds = st.environments(rat, "righting", RATS)


def actions(policies, seen):
    inner, outer = np.split(policies, [14 * HIDDEN], axis=1)
    inner, outer = inner.reshape(-1, 14, HIDDEN), outer.reshape(-1, HIDDEN + 1, 2)
    hidden = np.tanh(seen / SCALE @ inner[:, 1:] + inner[:, :1])
    return np.tanh(hidden @ outer[:, 1:] + outer[:, :1])


def scores(policies, seed):
    """Mean reward of each policy over an episode, and the tilts (deg) at the ends."""
    each, done = RATS // len(policies), np.zeros(RATS, bool)
    rewards, tilts = np.zeros(RATS), np.zeros(RATS)
    seen, _ = worlds.reset(seed=[seed + k % each for k in range(RATS)])
    while not done.all():
        chosen = actions(policies, seen.reshape(len(policies), each, -1))
        seen, reward, ended, over, _ = worlds.step(chosen.reshape(RATS, 2))
        rewards += np.where(done, 0, reward)
        last = (ended | over) & ~done
        tilts[last] = np.degrees(np.arccos(np.clip(seen[last, 2], -1, 1)))
        done |= last
    return rewards.reshape(-1, each).mean(axis=1), tilts


# %%
# Each round tries 64 policies in pairs of opposite changes, on the same starts.

rng = np.random.default_rng(0)
policy, mean, square, learned = 0.1 * rng.normal(size=14 * HIDDEN + 34), 0.0, 0.0, []
for k in range(1, ROUNDS + 1):
    noise = rng.normal(size=(PAIRS, policy.size))
    reward, tilt = scores(policy + 0.2 * np.vstack([noise, -noise]), 1000 * k)
    ranks = reward.argsort().argsort() / (2 * PAIRS - 1) - 0.5
    slope = (ranks[:PAIRS] - ranks[PAIRS:]) @ noise / (PAIRS * 0.2)
    mean, square = 0.9 * mean + 0.1 * slope, 0.99 * square + 0.01 * slope**2  # Adam
    policy = policy + 0.1 * mean / (1 - 0.9**k) / (np.sqrt(square / (1 - 0.99**k)) + 1e-8)
    learned.append(tilt.mean())
print(learned[0], np.mean(learned[-5:]))

"""
Learning to turn upright in a fall
==================================

``st.environments`` makes many Gymnasium environments that are simulated together.
Here 1024 rats fall at once, with random tilt and spin. A linear policy learns to right
them by the tail, by the cross-entropy method: draw policies at random, keep the best
ones, draw the next policies around them. This needs ``pip install "serpentail[gym]"``.
"""

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

POLICIES, EACH, BEST, ROUNDS = 32, 32, 8, 25
SCALE = np.array([1, 1, 1, 20, 20, 20, 1, 3, 1, 1, 50, 50, 1])  # of the observations
rat = st.build("kangaroo_rat_m1_n3")
worlds = st.environments(rat, "righting", POLICIES * EACH, step=2e-3, substeps=5)


def fall(policies, seeds):
    """Return the reward of each policy (P, 13, 2), and the tilts of the backs at the end."""
    count = POLICIES * EACH
    done, rewards, tilts = np.zeros(count, bool), np.zeros(count), np.zeros(count)
    seen, _ = worlds.reset(seed=seeds)
    while not done.all():
        chosen = np.tanh((seen / SCALE).reshape(POLICIES, EACH, 13) @ policies)
        seen, reward, ended, over, _ = worlds.step(chosen.reshape(count, 2))
        rewards += np.where(done, 0, reward)
        last = (ended | over) & ~done
        tilts[last] = np.degrees(np.arccos(np.clip(seen[last, 2], -1, 1)))
        done |= last
    return rewards.reshape(POLICIES, EACH).mean(axis=1), tilts


# %%
# The reward of a step is larger the more upright the back is. All policies learn from
# the same 32 starts, and are tested on 1024 other starts.

rng = np.random.default_rng(0)
mean, spread, learned = np.zeros((13, 2)), np.full((13, 2), 1.0), []
for _ in range(ROUNDS):
    policies = mean + spread * rng.normal(size=(POLICIES, 13, 2))
    rewards, tilts = fall(policies, list(range(EACH)) * POLICIES)
    best = policies[rewards.argsort()[-BEST:]]
    mean, spread = best.mean(axis=0), best.std(axis=0) + 0.05
    learned.append(tilts.mean())
new = list(range(1000, 1000 + POLICIES * EACH))
_, before = fall(np.zeros((POLICIES, 13, 2)), new)
_, after = fall(np.tile(mean, (POLICIES, 1, 1)), new)
print(f"tilt at the end on new starts: {before.mean():.0f} deg, learned {after.mean():.0f} deg")

# %%
# The first rounds try wild policies. ``examples/learning.py`` trains a neural network.

plt.style.use("seaborn-v0_8-colorblind")
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.4), layout="constrained")
left.plot(range(1, ROUNDS + 1), learned)
left.set(title="Policies improve", xlabel="round", ylabel="mean tilt at the end (deg)")
for tilts, name, line in [(before, "no torque", "--"), (after, "learned", "-")]:
    right.plot(np.sort(tilts), np.linspace(0, 100, len(tilts)), line, label=name)
right.set(title="More rats end nearly upright", xlabel="tilt at the end (deg)")
right.set_ylabel("rats below this tilt (%)")
right.legend()
plt.show()

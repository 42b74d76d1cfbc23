"""The ways to make runs: one after another, several in lanes, and by SciPy."""

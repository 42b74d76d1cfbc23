"""The paper's experiments and ours, with figures."""

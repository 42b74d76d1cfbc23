"""`python -m checks.stress`: models and runtime at their limits."""

"""`make stress`: models and runtime at their limits."""

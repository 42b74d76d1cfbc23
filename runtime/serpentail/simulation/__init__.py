"""Simulation: a model, a state and what acts on it go in, a trajectory comes out."""

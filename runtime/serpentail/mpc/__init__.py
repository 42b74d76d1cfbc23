"""Predictive control in C: corrects a plan at each tick."""

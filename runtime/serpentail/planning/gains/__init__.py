"""Feedback along a plan: Riccati gains, and where they hold."""

"""Torque laws, schedules, and what they become in the C of a run."""

"""Recorded motions: trajectories, contacts, and what they amount to."""

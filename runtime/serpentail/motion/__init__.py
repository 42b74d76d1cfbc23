"""Recorded motions: trajectories, contacts, and numbers that summarise them."""

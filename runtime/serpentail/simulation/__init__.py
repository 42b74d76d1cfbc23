"""Simulations: a motion, or many at once, under controllers and on the ground."""

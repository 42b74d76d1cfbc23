"""Gymnasium environments in which a learner moves the tail."""

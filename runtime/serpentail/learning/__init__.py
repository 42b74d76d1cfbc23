"""Environments in which a learner moves the tail, as Gymnasium has them."""

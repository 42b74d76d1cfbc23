"""Optimal control of a node's equations: stages with their collocation inside, FATROP, IPOPT."""

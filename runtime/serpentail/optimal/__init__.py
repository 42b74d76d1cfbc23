"""Optimal control of a node's equations: stages that solve their collocation inside, FATROP, IPOPT."""

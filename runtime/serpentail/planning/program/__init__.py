"""The optimal control problem of a plan: unknowns, nodes, start, end, and first guesses."""

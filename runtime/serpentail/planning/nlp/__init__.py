"""The nonlinear program: mesh, nodes, constraints, derivatives, solver."""

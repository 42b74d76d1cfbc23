"""Scene files: the model, simulation and plan that they describe."""

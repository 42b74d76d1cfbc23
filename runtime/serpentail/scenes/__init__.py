"""Scene files, and the models, simulations and plans that they describe."""

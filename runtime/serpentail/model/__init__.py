"""A generated model: its manifest, its parameters, its compiled C and its CasADi functions."""

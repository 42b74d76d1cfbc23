"""Motion, torques and parameters from marker tracks, with their confidence intervals."""

"""Makes models from Python: runs the generator in its own process, and caches the results."""

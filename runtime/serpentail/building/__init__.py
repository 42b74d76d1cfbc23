"""Making models from Python: the generator, run in a process of its own, and what it made, kept."""

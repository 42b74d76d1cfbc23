"""What to model: scene files, their rules and parameters."""

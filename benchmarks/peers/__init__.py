"""Other engines on the same models."""

"""Examples: a demonstration, and the studies."""

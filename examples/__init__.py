"""Examples: a demonstration, a gallery, and the studies."""

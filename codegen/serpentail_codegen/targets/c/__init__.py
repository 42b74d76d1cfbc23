"""The C target: sources and headers that need C99 alone, and the package around them."""

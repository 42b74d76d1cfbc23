"""The C target: sources and headers that need only C99, and the package around them."""

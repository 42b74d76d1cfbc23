"""`python -m benchmarks`: how fast and how accurate, beside peers."""

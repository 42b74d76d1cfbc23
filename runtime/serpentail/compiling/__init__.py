"""Compilers, and the cache of compiled libraries."""

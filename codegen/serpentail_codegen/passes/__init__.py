"""Rewrites of programs for speed."""

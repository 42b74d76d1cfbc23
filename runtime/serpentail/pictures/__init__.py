"""Drawings of motions."""

"""Derivatives of steps and of programs."""

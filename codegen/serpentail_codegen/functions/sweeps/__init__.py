"""Recursions along the tail."""

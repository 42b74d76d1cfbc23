"""Rates of airborne motion, and their derivatives."""

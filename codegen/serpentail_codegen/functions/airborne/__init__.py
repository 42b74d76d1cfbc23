"""Airborne motion as a plan's nodes need it: rates, and their first and second derivatives."""

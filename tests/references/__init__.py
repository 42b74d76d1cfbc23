"""Independent references, one per rigid-body library, that the generated models are compared
with.
"""

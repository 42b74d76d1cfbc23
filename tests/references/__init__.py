"""Independent references, one for each method or library, with which the generated models are
compared.
"""

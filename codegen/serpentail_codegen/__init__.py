"""Symbolic code generation: scenes go in, C and CasADi functions of their equations of motion come
out.
"""

__version__ = "0.2.0"

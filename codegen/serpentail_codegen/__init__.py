"""Generates C and CasADi functions of the equations of motion that a scene describes."""

__version__ = "0.2.0"

"""The equations of motion, one small step each, in SymPy."""

"""The CasADi target: a Python module that builds a ``casadi.Function`` for each function."""

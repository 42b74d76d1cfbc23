"""The linear systems of implicit integrators."""

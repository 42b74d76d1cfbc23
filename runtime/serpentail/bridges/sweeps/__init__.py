"""Sweeps: many runs over parameters, starts and scene keys, kept in a store that resumes."""

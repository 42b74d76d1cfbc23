"""Nonlinear programs in stages for FATROP; each stage solves its collocation equations inside."""

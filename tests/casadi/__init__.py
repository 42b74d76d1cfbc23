"""Tests of casadi."""

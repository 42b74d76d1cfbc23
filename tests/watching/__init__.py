"""Tests of views of runs and plans that are being made."""

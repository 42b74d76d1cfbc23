"""Tests of motions of several phases."""

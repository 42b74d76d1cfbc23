"""Tests of what the emitted C says of numbers that are none."""

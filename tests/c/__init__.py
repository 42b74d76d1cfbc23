"""Tests of c."""

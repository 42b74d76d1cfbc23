"""Tests of bridges to other tools."""

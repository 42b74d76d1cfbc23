"""Tests of models whose folders are generated again."""

"""Runs and plans seen in a browser while they are made."""

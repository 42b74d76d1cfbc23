"""Motions in the containers of other libraries, and in files that any program reads."""

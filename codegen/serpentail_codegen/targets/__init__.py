"""Targets: the languages that programs are printed in, each a package of its own."""

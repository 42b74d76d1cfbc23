"""Motions of several phases, such as a jump, a planned flight and a landing."""

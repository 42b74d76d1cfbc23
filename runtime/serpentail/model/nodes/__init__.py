"""A model's dynamics at many nodes as one CasADi function: in lanes, in threads, in C."""

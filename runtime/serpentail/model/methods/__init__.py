"""The methods of a model, in groups: each calls a compiled function."""

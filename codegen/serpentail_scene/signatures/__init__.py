"""Every function of a model: its name, arguments, meaning and group, in one place."""

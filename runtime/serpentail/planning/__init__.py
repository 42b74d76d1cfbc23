"""Motion planning by direct collocation: a model and an optimal control problem go in, a plan and its truth come out."""

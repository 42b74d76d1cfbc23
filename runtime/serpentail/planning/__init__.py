"""Motion planning by direct collocation: a model and a problem go in, a plan and its truth come
out.
"""

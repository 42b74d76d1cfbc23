"""The model's functions inside JAX and PyTorch, with exact derivatives of the generated C."""

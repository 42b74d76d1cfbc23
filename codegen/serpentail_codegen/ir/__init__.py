"""The intermediate representation: straight-line steps, and programs that loop over them."""

"""What the documentation site adds to Sphinx: links and docstrings."""

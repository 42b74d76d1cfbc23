"""The documents as a reader meets them: their blocks, run in order, and the site made of them."""

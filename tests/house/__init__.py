"""The rules of the house: layout, documents, make, determinism."""

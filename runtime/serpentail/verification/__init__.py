"""The laws that every model must obey, and how far it is from them."""

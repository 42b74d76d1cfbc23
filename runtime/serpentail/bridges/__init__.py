"""Other tools and formats; no other room imports them."""

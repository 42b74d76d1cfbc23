"""What is published: the wheel, its contents, and its use in empty environments."""

"""The functions that a scene can ask for, assembled from steps."""

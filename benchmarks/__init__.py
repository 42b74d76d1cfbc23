"""`make bench`: run time, accuracy and size, compared with other engines (peers)."""

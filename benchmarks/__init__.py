"""`make bench`: run time, accuracy and size, beside peers."""

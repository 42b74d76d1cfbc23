"""What a solved program means: curve, true flight, report."""

"""The page of a run: one HTML file that shows a motion and its numbers in any browser, offline."""

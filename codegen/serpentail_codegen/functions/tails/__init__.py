"""The tails: for each, the steps that describe one piece of a segment."""

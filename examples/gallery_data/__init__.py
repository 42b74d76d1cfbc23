"""Published animals and robots, and what our models of them do."""

"""Steps of many runs in place: what a controller, a policy or another tool drives step by step."""

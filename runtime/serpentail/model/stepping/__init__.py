"""Steps of many runs in place, for controllers, policies and tools that need one step at a time."""

"""Motion planning by direct collocation: torques of the tail that right the animal in the air."""

"""Properties of everything behind the model's door, for arguments that hypothesis makes up."""

"""What a motion looks like: pictures, the page of a run, a live view."""

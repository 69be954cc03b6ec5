"""How well force networks predict held-out recordings."""

"""Training of force networks and policies."""

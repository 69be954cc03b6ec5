"""Training of force networks and policies; nothing is here yet."""

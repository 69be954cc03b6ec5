"""Training runs of force networks, resumable."""

"""Training runs of policies, resumable."""

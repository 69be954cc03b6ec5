"""What changed between recordings, and when."""

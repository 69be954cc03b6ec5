"""Settings of a policy's world and training."""

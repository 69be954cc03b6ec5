"""From the logs of a policy back to its model."""

"""When a run must end, and how fast."""

"""What shakes in a log, and by what."""

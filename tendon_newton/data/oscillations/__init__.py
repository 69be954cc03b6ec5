"""Does a joint shake, at what frequency, and what of its loop makes it."""

"""A finger between two strings, each with a servo: a plant of its own, in NumPy alone."""

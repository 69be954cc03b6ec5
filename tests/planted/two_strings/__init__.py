"""A finger between two strings, each with a servo."""

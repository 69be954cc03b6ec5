"""Networks from a window of servo signals to a force, and their weights as a file without code."""

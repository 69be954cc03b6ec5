"""Logs with one known fault each, their clean twins, and what programs find in them."""

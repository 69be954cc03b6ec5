"""Errors of force networks on held-out recordings."""

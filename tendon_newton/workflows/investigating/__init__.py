"""Runs that are recorded, diagnosed and designed in turn."""

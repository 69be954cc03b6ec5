"""Faults made on purpose, and what must be done against each."""

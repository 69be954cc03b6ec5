"""Verbs of the command line that only a clone has, one per file."""

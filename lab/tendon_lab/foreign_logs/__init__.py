"""Readers of single published sets of logs: further formats of ``import``."""

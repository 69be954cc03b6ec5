"""Logs of other people."""

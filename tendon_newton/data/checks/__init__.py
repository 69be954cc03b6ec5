"""Defects of recordings, told as findings."""

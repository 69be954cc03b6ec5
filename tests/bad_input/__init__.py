"""Damaged, hostile and nonsensical files."""

"""Policies: their environment, their training and their files."""

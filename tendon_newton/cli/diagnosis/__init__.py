"""Verbs that look for causes, and choose what to record next."""

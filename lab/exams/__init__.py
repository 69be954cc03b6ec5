"""Exams of the diagnosis by planted causes, each a command; the plant stands with the tests."""

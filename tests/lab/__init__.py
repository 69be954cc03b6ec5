"""Tests of what only a clone has: the exam, the reproduction."""

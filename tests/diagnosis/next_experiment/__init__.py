"""Tests of what a diagnosis finds, proposes and shows."""

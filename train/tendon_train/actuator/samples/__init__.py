"""Recordings cut into the samples that a force network learns from."""

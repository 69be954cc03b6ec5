"""A policy that drives a finger, and its log."""

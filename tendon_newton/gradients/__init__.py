"""Rollouts that can be differentiated."""

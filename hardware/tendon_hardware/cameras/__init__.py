"""Cameras that say where the ball in a hand is."""

"""Climbs of stairs of goals, in simulation and on a bench."""

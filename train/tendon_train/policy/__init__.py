"""Policies: a finger that learns in simulation to bring its tip to a goal."""

"""Planted causes: data from a plant of its own, in which a diagnosis must find what was hidden."""

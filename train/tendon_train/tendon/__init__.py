"""The string of a finger: how much it gives and how loose it is."""

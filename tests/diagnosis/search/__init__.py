"""The search for causes: sets, refits and the parts of the data that choose."""

"""The search for causes: survey, choice of sparse sets, joint refits, pruning, one rule."""

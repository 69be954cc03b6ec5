"""Mistakes in recorded data, as people made them: through every door, each gets its line."""

"""Models carried into other programs."""

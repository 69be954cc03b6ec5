"""Fitting models to recordings: residuals, noise floors, least squares over many candidates at once, intervals."""

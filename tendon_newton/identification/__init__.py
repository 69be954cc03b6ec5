"""Fitting models to recordings: residuals, noise floors, parallel least squares, intervals."""

"""Joint coordinates to poses and mass matrices, inside kernels."""

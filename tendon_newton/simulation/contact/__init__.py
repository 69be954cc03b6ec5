"""Links against obstacles, inside kernels."""

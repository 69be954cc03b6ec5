"""The USD schema of a mechanism: layers, tendons, routes and obstacles."""

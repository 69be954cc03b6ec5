"""A mechanism as numbers: joints, links, tendons, routes, and the geometry between them."""

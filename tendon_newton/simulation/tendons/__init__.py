"""The tendon inside kernels: routes, spools, tension and the effects that act on it."""

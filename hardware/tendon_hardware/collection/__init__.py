"""Recording excitations on a bench."""

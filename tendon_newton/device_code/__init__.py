"""Device code, written once and compiled for any precision, mechanism and list of effects."""

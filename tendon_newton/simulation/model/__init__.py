"""A mechanism, an actuator and effects become arrays, parameters and compiled kernels."""

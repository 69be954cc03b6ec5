"""A bench in MuJoCo, as a reference."""

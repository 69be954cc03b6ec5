"""The same bench in MuJoCo, as a reference."""

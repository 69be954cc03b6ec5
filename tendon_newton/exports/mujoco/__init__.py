"""A bench and its servo in plain MuJoCo: MJCF, and a program that steps what MJCF cannot say."""

"""Is it told which part of a servo wears."""

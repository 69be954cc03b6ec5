"""Which part of a servo wears, by logs of several days."""

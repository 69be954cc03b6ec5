"""Files that are written while a bench runs."""

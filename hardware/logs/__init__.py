"""What is written while a bench runs."""

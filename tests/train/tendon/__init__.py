"""What is found of a finger's string."""

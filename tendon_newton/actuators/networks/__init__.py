"""Force networks inside the simulator: their file, their history, and how they are asked."""

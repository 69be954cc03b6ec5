"""What no named cause explains: its size, its structure and a formula for it."""

"""What no named cause explains: its size and its structure."""

"""What a packaged force network or policy says of itself."""

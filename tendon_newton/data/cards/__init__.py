"""Cards: the description inside a packaged force network or policy."""

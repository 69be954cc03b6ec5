"""Text, TOML, JSON and foreign files, read with bounds and with errors of our own."""

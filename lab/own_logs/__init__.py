"""Logs of nine strangers, and what the documented commands make of them."""

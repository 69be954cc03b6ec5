"""Logs of five strangers, and what the documented commands make of them."""

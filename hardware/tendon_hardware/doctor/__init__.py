"""Examine a bench before it is used: ports, servo, load cell and clock, with what to do."""

"""The wire to a servo: its port, what goes over it, and what watches over it."""

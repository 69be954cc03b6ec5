"""A servo, a load cell and their ports as one bench."""

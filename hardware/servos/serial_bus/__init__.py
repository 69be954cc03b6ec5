"""The wire to a servo: port, packets, transactions, and what watches over it."""

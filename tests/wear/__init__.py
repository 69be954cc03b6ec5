"""What wears is told from dated logs."""

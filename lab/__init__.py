"""What measures the product, and its tests: nothing of the product imports it."""

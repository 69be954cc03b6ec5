"""Results with the scripts that make them."""

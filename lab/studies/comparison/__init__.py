"""One page that compares everybody on the same logs and splits."""

"""Speed, skipped by default; `make bench` runs it."""

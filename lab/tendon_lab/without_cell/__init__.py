"""Force networks from recordings without a load cell."""

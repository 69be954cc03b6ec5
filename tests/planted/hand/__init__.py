"""A hand of four fingers that share nothing, each with a servo."""

"""The parallel worlds that a policy learns in."""

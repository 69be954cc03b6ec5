"""Whether an investigation is worth more than a fixed plan, and keeps the limits of a bench."""

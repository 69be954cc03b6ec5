"""From what a bench did under its policy back to the model, and from there to a better policy."""

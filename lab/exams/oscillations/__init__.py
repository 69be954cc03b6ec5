"""Is it told what makes a loop shake."""

"""The run that separates causes which the data cannot tell apart."""

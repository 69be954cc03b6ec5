"""The bench's programs on a bench that is not there, through real drivers and protocols."""

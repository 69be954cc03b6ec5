"""What is wrong with recordings, told as findings."""

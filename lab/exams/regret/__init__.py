"""What a better set would save: all sets of a few causes beside each answer."""

"""The steps of the reproduction, one file each."""

"""Spoilt files of every format that the program reads; `python -m tests.fuzz --help`."""

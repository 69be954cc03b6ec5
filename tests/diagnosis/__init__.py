"""Tests of file formats, the command line and imports."""

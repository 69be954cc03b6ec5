"""Promises that every entry of a table keeps."""

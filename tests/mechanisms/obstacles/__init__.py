"""Tests of the USD assets and the mechanisms read from them."""

"""Tests of noise floors and least squares."""

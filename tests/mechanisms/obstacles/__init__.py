"""Tests of obstacles, also of links that are some, in mechanisms and assets."""

"""Tests of what users read: README, site, notebook, pages that are made from tables."""

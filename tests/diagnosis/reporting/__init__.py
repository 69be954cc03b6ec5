"""Tests of reports and of what they show."""

"""Tests of the lab: of what measures the product."""

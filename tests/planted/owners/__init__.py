"""Fingers whose strings have a servo each: their plant, faults with owners, an exam."""

"""Verbs that drive a finger, or a virtual one."""

"""Verbs that train networks, tendons and policies, and judge them."""

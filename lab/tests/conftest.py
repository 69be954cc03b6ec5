"""Fixtures of the product's tests, for the lab's."""

from tests.conftest import nobody_at_the_keys, own_trust, rng, shared

__all__ = ["nobody_at_the_keys", "own_trust", "rng", "shared"]

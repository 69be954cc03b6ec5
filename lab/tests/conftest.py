"""Fixtures of the product's tests, for the lab's."""

from tests.conftest import nobody_at_the_keys, own_trust, rng, shared
from tests.diagnosis.reporting.conftest import browser

__all__ = ["browser", "nobody_at_the_keys", "own_trust", "rng", "shared"]

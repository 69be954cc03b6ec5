"""Fixtures of the product's tests, for the lab's."""

from tests.conftest import nobody_at_the_keys, own_trust, rng, shared
from tests.diagnosis.reporting.test_browser import browser
from tests.scheduling.test_scheduler import cluster

__all__ = ["browser", "cluster", "nobody_at_the_keys", "own_trust", "rng", "shared"]

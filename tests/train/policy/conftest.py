"""The list of trusted files of these tests is not the user's."""

from tests.train.actuator.conftest import own_trust

__all__ = ["own_trust"]

"""The browser in which reports are looked at."""

import pytest

from tests.diagnosis.reporting.browser import find_browser


@pytest.fixture(scope="module")
def browser() -> str:
    """Path of Chromium; the tests that need it are skipped without one."""
    found = find_browser()
    if found is None:
        pytest.skip("needs Chromium (Debian: apt-get install chromium)")
    return found

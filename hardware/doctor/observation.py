"""One thing that was looked at."""

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["good", "note", "fix"]
"""``note``: works, but should be known; ``fix``: data taken now would be bad, or none."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Observation:
    """One thing that was looked at, and what to do about it."""

    subject: str
    """What was looked at, in a word or two."""
    verdict: Verdict
    """How it is."""
    found: str
    """What was seen, with numbers."""
    remedy: str = ""
    """What to do; empty where all is well."""

"""The result of one check of a bench."""

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["good", "note", "fix"]
"""``note``: works, but should be known; ``fix``: data taken now would be bad, or none."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Observation:
    """One thing that was looked at, and what to do about it."""

    subject: str  # Checked part of the bench, in a word or two
    verdict: Verdict  # Result of the check
    found: str  # Evidence, with numbers
    remedy: str = ""  # Remedy; empty where all is well


def observed(verdict: Verdict, subject: str, found: str, remedy: str = "") -> Observation:
    """Return an observation; a remedy only stands where all is not well."""
    remedy = "" if verdict == "good" else remedy
    return Observation(subject=subject, verdict=verdict, found=found, remedy=remedy)

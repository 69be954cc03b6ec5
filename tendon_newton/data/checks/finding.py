"""One thing about recorded data that a reader of results must know."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

SEVERITIES = ("defect", "caution", "note")
Severity = Literal["note", "caution", "defect"]


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One thing about the data that a reader of results must know."""

    recording: str  # File name, or ``all``
    channel: str  # Column that is concerned
    evidence: str  # Evidence, with numbers
    consequence: str  # Consequence for the use of the data
    # ``defect``: wrong as it stands; ``caution``: misleads a fit; ``note``: good to know
    severity: Severity
    check: str = ""  # Name of the check that found it, in ``lint.CHECKS``
    safe: bool = False  # Whether ``--mend`` does what the consequence says


@dataclass(frozen=True)
class Examined:
    """Column of a recording that is looked at."""

    recording: str  # File name, or ``all``
    channel: str  # Column

    def defect(self, evidence: str, consequence: str) -> Finding:
        """Return what is wrong as it stands."""
        return self.found("defect", evidence, consequence)

    def caution(self, evidence: str, consequence: str) -> Finding:
        """Return what misleads a fit."""
        return self.found("caution", evidence, consequence)

    def note(self, evidence: str, consequence: str) -> Finding:
        """Return what is good to know."""
        return self.found("note", evidence, consequence)

    def found(self, severity: Severity, evidence: str, consequence: str) -> Finding:
        """Return a finding of any severity."""
        return Finding(
            recording=self.recording,
            channel=self.channel,
            evidence=evidence,
            consequence=consequence,
            severity=severity,
        )


def findings_text(findings: Iterable[Finding], most: int | None = None) -> list[str]:
    """Write each kind of finding once, the worst first, with evidence of so many recordings."""
    lines: list[str] = []
    for first, *others in kinds_of(findings):
        group = [first, *others]
        lines += ["", f"{first.severity}, {first.channel}: {what_follows(first)}"]
        width = max(len(finding.recording) for finding in group)
        lines += [f"  {finding.recording:{width}}  {finding.evidence}" for finding in group[:most]]
        if most is not None and len(group) > most:
            lines += [f"  and {len(group) - most} more recordings"]
    return lines


def kinds_of(findings: Iterable[Finding]) -> list[list[Finding]]:
    """Gather findings of one kind, which differ in recording and evidence, the worst first."""
    kinds: dict[tuple[str, str, str], list[Finding]] = {}
    for finding in sorted(findings, key=lambda f: SEVERITIES.index(f.severity)):
        kind = (finding.severity, finding.channel, finding.consequence)
        kinds.setdefault(kind, []).append(finding)
    return list(kinds.values())


def what_follows(finding: Finding) -> str:
    """Say what follows of a finding, and whether ``--mend`` does it."""
    return finding.consequence + (" (--mend does it)" if finding.safe else "")

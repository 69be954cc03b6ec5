"""Findings of a check of an asset."""

from dataclasses import dataclass
from typing import Any, Literal

STAGE = "/"  # Stands in the place of a prim for the whole stage
Severity = Literal["error", "warning", "note"]


@dataclass(frozen=True, kw_only=True)
class AssetFinding:
    """One thing that is wrong, doubtful or worth knowing about an asset."""

    prim: str  # Path of the prim, or `STAGE`
    rule: str  # Name of the rule
    message: str  # Expected and found values, without a full stop
    remedy: str  # Remedy, without a full stop
    # An ``error`` cannot be simulated, a ``warning`` should be mended, a ``note`` informs
    severity: Severity


@dataclass(frozen=True)
class Judged:
    """Prim that a rule looks at."""

    prim: str  # Path of the prim, or `STAGE`
    rule: str  # Name of the rule

    def error(self, message: str, remedy: str) -> AssetFinding:
        """Return what cannot be simulated."""
        return self.found("error", message, remedy)

    def warning(self, message: str, remedy: str) -> AssetFinding:
        """Return what should be mended."""
        return self.found("warning", message, remedy)

    def found(self, severity: Severity, message: str, remedy: str) -> AssetFinding:
        """Return a finding of any severity."""
        return AssetFinding(
            prim=self.prim, rule=self.rule, message=message, remedy=remedy, severity=severity
        )


def about(prim: Any, rule: str) -> Judged:
    """Begin a finding of a rule about a prim of a stage, or about the path of one."""
    return Judged(prim if isinstance(prim, str) else str(prim.GetPath()), rule)

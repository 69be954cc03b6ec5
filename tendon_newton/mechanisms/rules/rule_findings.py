"""Findings of a check of an asset."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

STAGE = "/"
"""Stands in the place of a prim for the whole stage."""
Severity = Literal["error", "warning", "note"]


@dataclass(frozen=True, kw_only=True)
class AssetFinding:
    """One thing that is wrong, doubtful or worth knowing about an asset."""

    prim: str
    """Path of the prim, or `STAGE`."""
    rule: str
    """Name of the rule."""
    message: str
    """Expected and found values, without a full stop."""
    remedy: str
    """Remedy, without a full stop."""
    severity: Severity
    """An ``error`` cannot be simulated, a ``warning`` should be mended, a ``note`` informs."""


def about(
    prim: Any, rule: str, message: str, remedy: str, severity: Severity = "error"
) -> AssetFinding:
    """Build the finding about a prim of a stage, or about the path of one."""
    path = prim if isinstance(prim, str) else str(prim.GetPath())
    return AssetFinding(prim=path, rule=rule, message=message, remedy=remedy, severity=severity)

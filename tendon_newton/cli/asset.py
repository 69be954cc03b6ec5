"""Check a bench's USD asset, or draw how it closes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

if TYPE_CHECKING:
    from tendon_newton.mechanisms.findings import AssetFinding

EXIT_FINDINGS = 1
"""Exit code where an asset was read and has errors; an unreadable one gives 2."""


@dataclass(frozen=True, kw_only=True)
class Check:
    """Check an asset: USD's own validators, units, masses, joints, springs, tendons."""

    asset: tyro.conf.Positional[str]
    """Name under assets/, or path of a USD file."""


@dataclass(frozen=True, kw_only=True)
class Show:
    """Draw excursion, moment arms, closing force and postures into a PNG file."""

    asset: tyro.conf.Positional[str]
    """Name under assets/, or path of a USD file."""
    out: Path | None = None
    """Picture to write; <name>.png in the current folder by default."""


Asset = (
    Annotated[Check, tyro.conf.subcommand("check")] | Annotated[Show, tyro.conf.subcommand("show")]
)


def main(config: Asset) -> None:
    """Run the chosen action."""
    import warp as wp

    wp.config.log_level = wp.LOG_ERROR  # nothing here needs a GPU, so none is missed
    if isinstance(config, Check):
        check(config)
    else:
        show(config)


def check(config: Check) -> None:
    """Print the findings about an asset; leave with code 1 where one is an error."""
    from tendon_newton.mechanisms.checks import check_asset

    findings = check_asset(config.asset)
    for line in table(findings):
        print(line)
    errors = sum(finding.severity == "error" for finding in findings)
    warnings = sum(finding.severity == "warning" for finding in findings)
    print(f"{config.asset}: {_count(errors, 'error')}, {_count(warnings, 'warning')}")
    if errors:
        raise SystemExit(EXIT_FINDINGS)


def _count(number: int, noun: str) -> str:
    return f"{number or 'no'} {noun}{'' if number == 1 else 's'}"


def table(findings: Sequence[AssetFinding]) -> list[str]:
    """Lay findings out: severity, rule and prim in columns, the message and remedy below."""
    lines = []
    width = max((len(finding.rule) for finding in findings), default=0)
    for finding in findings:
        lines.append(f"{finding.severity:8} {finding.rule:{width}}  {finding.prim}")
        lines.append(f"         {finding.message}. {finding.remedy}.")
    return lines


def show(config: Show) -> None:
    """Draw an asset and print where the picture is."""
    from tendon_newton.mechanisms.asset_plot import plot_asset
    from tendon_newton.mechanisms.mechanism import load_mechanism

    mechanism = load_mechanism(config.asset)
    path = config.out or Path(f"{mechanism.name}.png")
    plot_asset(mechanism, path)
    print(path)

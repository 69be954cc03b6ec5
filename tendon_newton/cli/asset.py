"""Start, check, draw, import or export a bench's USD asset."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from tendon_newton.cli.asset_interchange import Export, Import, export_asset, import_asset
from tendon_newton.device_code.quiet import quiet_warp

if TYPE_CHECKING:
    from tendon_newton.mechanisms.rules.findings import AssetFinding

EXIT_FINDINGS = 1
"""Exit code where an asset was read and has errors; an unreadable one gives 2."""


@dataclass(frozen=True, kw_only=True)
class New:
    """Write a starting asset of a finger: joints in a row, springs that open them, one tendon.

    Give one value per joint from the base to the tip, or one for all. Edit the numbers in the
    files, then check and show it: docs/your_own_finger.md.
    """

    name: tyro.conf.Positional[str]
    """Name of the finger; its folder, its file and its root prim have it."""
    joints: tuple[str, ...] = ("pip", "dip")
    """Names of the joints, from the base to the tip."""
    length: tuple[float, ...] = (0.030,)
    """From each joint to the next, and to the tip [m]."""
    mass: tuple[float, ...] = (0.010,)
    """Mass of each link, a slender rod [kg]."""
    moment_arm: tuple[float, ...] = (0.008,)
    """Tendon excursion per joint angle [m/rad], positive closes."""
    stiffness: tuple[float, ...] = (0.045,)
    """Return spring of each joint [N m/rad]."""
    range: tuple[float, ...] = (1.57,)
    """Angle at which each joint is closed [rad]; it is open at 0."""
    damping: tuple[float, ...] = (5.0e-4,)
    """Viscous damping of each joint [N m s/rad]."""
    spool_radius: float = 0.0125
    """Radius of the spool that winds the tendon [m]."""
    force_limit: float = 21.0
    """The most that the servo can pull [N]."""
    folder: Path = Path()
    """Where the new folder goes; list it in TENDON_NEWTON_ASSETS to use the finger by its name."""


@dataclass(frozen=True, kw_only=True)
class Check:
    """Check an asset: USD's own validators, units, masses, joints, springs, tendons."""

    asset: tyro.conf.Positional[str]
    """Name under assets/, or path of a USD file."""


@dataclass(frozen=True, kw_only=True)
class Show:
    """Draw excursion, moment arms, closing force, postures and a view in space into a PNG file."""

    asset: tyro.conf.Positional[str]
    """Name under assets/, or path of a USD file."""
    out: Path | None = None
    """Picture to write; <name>.png in the current folder by default."""
    window: bool = False
    """Also open Newton's own viewer and let the finger close and open there."""


Asset = (
    Annotated[New, tyro.conf.subcommand("new")]
    | Annotated[Check, tyro.conf.subcommand("check")]
    | Annotated[Show, tyro.conf.subcommand("show")]
    | Annotated[Import, tyro.conf.subcommand("import")]
    | Annotated[Export, tyro.conf.subcommand("export")]
)


def main(config: Asset) -> None:
    """Run the chosen action."""
    if isinstance(config, New):
        new(config)
        return
    quiet_warp()
    if isinstance(config, Import):
        import_asset(config)
    elif isinstance(config, Export):
        export_asset(config)
    elif isinstance(config, Check):
        check(config)
    else:
        show(config)


def new(config: New) -> None:
    """Write a starting asset and print what to do with it."""
    from tendon_newton.mechanisms.asset_library import check_new_name
    from tendon_newton.mechanisms.authoring.asset_plan import plan_asset, write_asset

    check_new_name(config.name)
    plan = plan_asset(
        config.name,
        config.joints,
        spool_radius=config.spool_radius,
        force_limit=config.force_limit,
        length=config.length,
        mass=config.mass,
        moment_arm=config.moment_arm,
        stiffness=config.stiffness,
        range=config.range,
        damping=config.damping,
    )
    path = write_asset(config.folder, plan)
    print(path)
    print(f"edit the numbers in {path.parent}, then")
    print(f"  tendon-newton asset check {path}")
    print(f"  tendon-newton asset show {path}")


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
    from tendon_newton.mechanisms.authoring.asset_plot import plot_asset
    from tendon_newton.mechanisms.loading import load_mechanism

    mechanism = load_mechanism(config.asset)
    path = config.out or Path(f"{mechanism.name}.png")
    plot_asset(mechanism, path)
    print(path)
    if config.window:
        from tendon_newton.mechanisms.authoring.asset_window import show_in_window

        show_in_window(mechanism)

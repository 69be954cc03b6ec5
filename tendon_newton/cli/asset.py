"""Start, check, draw, import or export a bench's USD asset."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.errors import InvalidAsset

if TYPE_CHECKING:
    from tendon_newton.mechanisms.authoring.direct_plan import DirectPlan, Kind
    from tendon_newton.mechanisms.rules.rule_findings import AssetFinding


@dataclass(frozen=True, kw_only=True)
class Import:
    """Turn an MJCF or URDF file into an asset, with what drives it in a small layer on top.

    With --moment-arm it is a finger that one tendon closes; else each joint has a servo of its own.
    Newton reads the file; links.usda gets what it says, tendon.usda above it what it cannot say.
    The base is fixed, fixed joints are merged, and of shapes one bone per link is drawn; meshes are
    not read. An end stop that the file does not describe becomes that of the nominal finger.
    """

    file: tyro.conf.Positional[Path]  # MJCF (.xml) or URDF (.urdf).
    name: tyro.conf.Positional[str]
    """Name of the asset; its folder, its file and its root prim have it."""
    moment_arm: tuple[float, ...] = ()
    """Tendon excursion per joint angle [m/rad], positive closes; one per joint or one for all."""
    stiffness: tuple[float, ...] = ()
    """Return spring of each joint [N m/rad], for a file without springs."""
    tip: tuple[float, float, float] | None = None
    """The tip in a link's frame [m]; by default the site named tip of an MJCF file."""
    tip_link: str | None = None  # Link of the tip; the last by default.
    spool_radius: float = 0.0125  # Radius of the spool that winds the tendon [m].
    force_limit: float = 21.0
    """The most that the servo can pull [N]; torque [N m] where each joint has one."""
    folder: Path = Path()
    """Parent of the new folder; list it in TENDON_NEWTON_ASSETS to use the finger by its name."""


@dataclass(frozen=True, kw_only=True)
class Export:
    """Write an asset as MJCF for plain MuJoCo, with a motor on each tendon: control is tension."""

    asset: tyro.conf.Positional[str]  # Name under assets/, or path of a USD file.
    out: Path | None = None  # File to write; <name>.xml in the current folder by default.


def import_asset(config: Import) -> None:
    """Write the layers and print what to do with them."""
    from tendon_newton.mechanisms.asset_library import check_new_name
    from tendon_newton.mechanisms.authoring.foreign_file import read_foreign
    from tendon_newton.mechanisms.authoring.foreign_plan import plan_foreign, write_foreign

    check_new_name(config.name)
    source = read_foreign(config.file)
    plan = plan_foreign(
        config.name,
        source,
        moment_arm=config.moment_arm,
        stiffness=config.stiffness,
        tip=config.tip,
        tip_link=config.tip_link,
        spool_radius=config.spool_radius,
        force_limit=config.force_limit,
    )
    path = write_foreign(config.folder, plan)
    if source.meshes:
        print(f"left out, since no mesh is read: {_count(source.meshes, 'shape')} from files")
    print_next(path, f"what drives it in {path.parent / 'tendon.usda'}")


def export_asset(config: Export) -> None:
    """Write the file and print where it is."""
    from tendon_newton.mechanisms.authoring.mujoco_file import write_mujoco
    from tendon_newton.mechanisms.loading import load_mechanism

    mechanism = load_mechanism(config.asset)
    path = config.out or Path(f"{mechanism.name}.xml")
    write_mujoco(path, mechanism)
    print(path)
    print(f"  python -m mujoco.viewer --mjcf={shlex.quote(str(path))}")


FINGER = {
    "length": (0.030,),
    "mass": (0.010,),
    "stiffness": (0.045,),
    "range": (1.57,),
    "damping": (5.0e-4,),
}
"""Numbers of a finger where none is given; other benches have some of them."""
FINGER_ALONE = {"joints": ("pip", "dip"), "moment_arm": (0.008,), "spool_radius": 0.0125}
"""Numbers that only a finger has."""
EXIT_FINDINGS = 1  # Exit code where an asset was read and has errors; an unreadable one gives 2.


@dataclass(frozen=True, kw_only=True)
class New:
    """Write a starting asset: of a finger, a cart on a rail or a string, or a mass on a shaft.

    A finger has joints in a row, springs that open them and one tendon: give one value per joint
    from the base to the tip, or one for all. A slider and a shaft have a drive that pushes as well
    as pulls; mass, length, range, damping, stiffness and force limit say all of them, in SI units
    of any size. A cart is pulled by a string against a spring. Edit the numbers in the files, then
    check and show it: docs/your_own_finger.md.
    """

    name: tyro.conf.Positional[str]
    """Name of the bench; its folder, its file and its root prim have it."""
    kind: Literal["finger", "slider", "shaft", "cart"] = "finger"  # What it is.
    joints: tuple[str, ...] = ("pip", "dip")  # Names of the joints, from the base to the tip.
    length: tuple[float, ...] | None = None
    """From each joint to the next, and to the tip, 0.030 unless given; arm of a shaft, 0.1 [m]."""
    mass: tuple[float, ...] | None = None
    """Mass of each link, a slender rod, 0.010 unless given; of a slider, or at an arm's end, 1
    [kg]; of a cart 0.05."""
    moment_arm: tuple[float, ...] = (0.008,)
    """Tendon excursion per joint angle [m/rad], positive closes."""
    stiffness: tuple[float, ...] | None = None
    """Return spring of each joint [N m/rad], 0.045 unless given; of a slider or shaft none, of
    a cart 200 [N/m]."""
    range: tuple[float, ...] | None = None
    """Angle at which each joint is closed [rad], 1.57 unless given, open at 0; travel of a slider,
    half of it to either side of 0, 1 [m], of a cart from 0, 0.08 [m]."""
    damping: tuple[float, ...] | None = None
    """Viscous damping of each joint [N m s/rad], 5e-4 unless given; of a slider none, of a cart 5
    [N s/m]."""
    spool_radius: float = 0.0125  # Radius of the spool that winds the tendon [m].
    force_limit: float | None = None
    """The most that the servo can pull [N], 21 unless given; that a drive gives [N, N m], 100."""
    folder: Path = Path()
    """Parent of the new folder; list it in TENDON_NEWTON_ASSETS to use the finger by its name."""


@dataclass(frozen=True, kw_only=True)
class Check:
    """Check an asset: USD's own validators, units, masses, joints, springs, tendons."""

    asset: tyro.conf.Positional[str]
    """Name under assets/, or path of a USD file or of an asset's folder."""


@dataclass(frozen=True, kw_only=True)
class Show:
    """Draw excursion, moment arms, closing force, postures and a view in space into a PNG file."""

    asset: tyro.conf.Positional[str]
    """Name under assets/, or path of a USD file or of an asset's folder."""
    out: Path | None = None  # Picture to write; <name>.png in the current folder by default.


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
    from tendon_newton.mechanisms.authoring.direct_plan import write_direct_asset

    check_new_name(config.name)
    if config.kind != "finger":
        path = write_direct_asset(config.folder, direct_plan(config, config.kind))
    else:
        plan = plan_asset(
            config.name,
            config.joints,
            spool_radius=config.spool_radius,
            force_limit=21.0 if config.force_limit is None else config.force_limit,
            moment_arm=config.moment_arm,
            **{key: getattr(config, key) or value for key, value in FINGER.items()},
        )
        path = write_asset(config.folder, plan)
    print_next(path, f"the numbers in {path.parent}")


def print_next(path: Path, what: str) -> None:
    """Print a new asset and what to do with it."""
    print(f"{path}\nedit {what}, then")
    for verb in ("check", "show"):
        print(f"  tendon-newton asset {verb} {shlex.quote(str(path))}")


def direct_plan(config: New, kind: Kind) -> DirectPlan:
    """Return the plan of a cart or a shaft.

    Raises:
        InvalidAsset: A number has several values, or belongs to a finger.
    """
    from tendon_newton.mechanisms.authoring.direct_plan import CART, DirectPlan

    given = {key: getattr(config, key) for key in FINGER if getattr(config, key) is not None}
    for key, values in given.items():
        if len(values) != 1:
            raise InvalidAsset(f"{key} of a {kind} is one number; there are {len(values)}")
    for key, value in FINGER_ALONE.items():
        wound = kind == "cart" and key == "spool_radius"
        if not wound and getattr(config, key) != value:
            raise InvalidAsset(f"{key} belongs to a finger; the bench is a {kind}")
    if kind != "shaft" and "length" in given:
        raise InvalidAsset(f"length is of a finger's links or a shaft's arm; the bench is a {kind}")
    numbers = {**CART, "spool_radius": config.spool_radius} if kind == "cart" else {"mass": 1.0}
    numbers |= {key: values[0] for key, values in given.items()}
    if config.force_limit is not None:
        numbers["force_limit"] = config.force_limit
    return DirectPlan(name=config.name, kind=kind, **numbers)


def check(config: Check) -> None:
    """Print the findings about an asset; leave with code 1 where one is an error."""
    from tendon_hardware.servos import SERVOS
    from tendon_newton.mechanisms.checks import check_asset

    findings = check_asset(config.asset, SERVOS)
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
    lines: list[str] = []
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

"""The part of `asset` that trades with other formats: MJCF and URDF in, MJCF out."""

from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True, kw_only=True)
class Import:
    """Turn an MJCF or URDF file into an asset, with what drives it in a small layer on top.

    With --moment-arm it is a finger that one tendon closes; else each joint has a servo of its own.
    Newton reads the file; links.usda gets what it says, tendon.usda above it what it cannot say.
    The base is fixed, fixed joints are merged, and of shapes one bone per link is drawn. An end
    stop that the file does not describe becomes that of the nominal finger.
    """

    file: tyro.conf.Positional[Path]
    """MJCF (.xml) or URDF (.urdf)."""
    name: tyro.conf.Positional[str]
    """Name of the asset; its folder, its file and its root prim have it."""
    moment_arm: tuple[float, ...] = ()
    """Tendon excursion per joint angle [m/rad], positive closes; one per joint or one for all."""
    stiffness: tuple[float, ...] = ()
    """Return spring of each joint [N m/rad], for a file without springs."""
    tip: tuple[float, float, float] | None = None
    """The tip in a link's frame [m]; by default the site named tip of an MJCF file."""
    tip_link: str | None = None
    """Link of the tip; the last by default."""
    spool_radius: float = 0.0125
    """Radius of the spool that winds the tendon [m]."""
    force_limit: float = 21.0
    """The most that the servo can pull [N]; torque [N m] where each joint has one."""
    folder: Path = Path()
    """Parent of the new folder; list it in TENDON_NEWTON_ASSETS to use the finger by its name."""


@dataclass(frozen=True, kw_only=True)
class Export:
    """Write an asset as MJCF for plain MuJoCo, with a motor on each tendon: control is tension."""

    asset: tyro.conf.Positional[str]
    """Name under assets/, or path of a USD file."""
    out: Path | None = None
    """File to write; <name>.xml in the current folder by default."""


def import_asset(config: Import) -> None:
    """Write the layers and print what to do with them."""
    from tendon_newton.mechanisms.asset_library import check_new_name
    from tendon_newton.mechanisms.authoring.foreign_asset import write_foreign
    from tendon_newton.mechanisms.authoring.foreign_file import read_foreign
    from tendon_newton.mechanisms.authoring.foreign_plan import plan_foreign

    check_new_name(config.name)
    plan = plan_foreign(
        config.name,
        read_foreign(config.file),
        moment_arm=config.moment_arm,
        stiffness=config.stiffness,
        tip=config.tip,
        tip_link=config.tip_link,
        spool_radius=config.spool_radius,
        force_limit=config.force_limit,
    )
    path = write_foreign(config.folder, plan)
    print(path)
    print(f"edit what drives it in {path.parent / 'tendon.usda'}, then")
    print(f"  tendon-newton asset check {path}")
    print(f"  tendon-newton asset show {path}")


def export_asset(config: Export) -> None:
    """Write the file and print where it is."""
    from tendon_newton.mechanisms.authoring.mujoco_file import write_mujoco
    from tendon_newton.mechanisms.loading import load_mechanism

    mechanism = load_mechanism(config.asset)
    path = config.out or Path(f"{mechanism.name}.xml")
    write_mujoco(path, mechanism)
    print(path)
    print(f"  python -m mujoco.viewer --mjcf={path}")

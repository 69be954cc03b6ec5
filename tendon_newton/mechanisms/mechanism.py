"""The door of this package: a bench read from USD, and its Newton model for many worlds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import newton

from tendon_newton.data.recording import Array, BenchOverrides
from tendon_newton.errors import InvalidAsset
from tendon_newton.mechanisms import worlds
from tendon_newton.mechanisms.asset_library import asset_path
from tendon_newton.mechanisms.obstacles import Obstacle
from tendon_newton.mechanisms.overrides import override_mechanism
from tendon_newton.mechanisms.parts import Joint, JointKind, Tendon, Tip, freeze_arrays
from tendon_newton.mechanisms.rules.stage_rules import stage_findings
from tendon_newton.mechanisms.stage_file import open_stage, usd_errors
from tendon_newton.mechanisms.usd import usd_asset
from tendon_newton.mechanisms.usd.usd_obstacle import read_obstacles


@dataclass(frozen=True, kw_only=True)
class Mechanism:
    """Joints, links, springs and tendons of one bench; joint j is also body j and DOF j."""

    name: str
    """Name of the asset's folder, or of its default prim for a file elsewhere."""
    asset: Path
    """The USD file that it came from."""
    joints: tuple[Joint, ...]
    """Joints in the order of the degrees of freedom."""
    tendons: tuple[Tendon, ...]
    tip: Tip | None
    """The point that recordings follow, where the asset has a site named ``tip``."""
    gravity: Array
    """Acceleration of gravity [m/s^2], shape (3,)."""
    template: newton.ModelBuilder = field(repr=False, compare=False)
    """One world, as Newton read it from the asset."""
    obstacles: tuple[Obstacle, ...] = ()
    """What is in its way; see `with_obstacles`."""

    def __post_init__(self) -> None:
        freeze_arrays(self)
        if not self.joints:
            raise InvalidAsset(f"{self.asset} has no joints; a mechanism needs at least one.")
        if not self.tendons:
            raise InvalidAsset(f"{self.asset} has no tendon; nothing could move it.")

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints."""
        return tuple(joint.name for joint in self.joints)

    @property
    def joint_kinds(self) -> tuple[JointKind, ...]:
        """Kinds of the joints."""
        return tuple(joint.kind for joint in self.joints)

    @property
    def joint_limits(self) -> tuple[tuple[float, float], ...]:
        """Ends of each joint's range [rad]."""
        return tuple(joint.limits for joint in self.joints)

    @property
    def link_masses(self) -> tuple[float, ...]:
        """Mass that each joint moves by itself [kg]."""
        return tuple(joint.mass for joint in self.joints)

    @property
    def link_lengths(self) -> tuple[float | None, ...]:
        """Length of the link behind each joint [m]; None where it has none."""
        return tuple(joint.length for joint in self.joints)

    def with_overrides(self, overrides: BenchOverrides) -> Mechanism:
        """Return this mechanism with the numbers of one recording in place of its own."""
        return override_mechanism(self, overrides)

    def with_obstacles(self, *obstacles: Obstacle) -> Mechanism:
        """Return this mechanism with further things in its way.

        Its links meet them with the capsules that the asset gives them to look at. Every simulator
        then simulates contact; one of a mechanism without obstacles pays nothing for it.
        """
        return replace(self, obstacles=(*self.obstacles, *obstacles))

    def build(
        self,
        world_count: int,
        *,
        overrides: Sequence[BenchOverrides] | None = None,
        requires_grad: bool = False,
        device: Any = None,
    ) -> newton.Model:
        """Build one Newton model that holds this mechanism in every world.

        With W worlds, J joints and D tendons the arrays of the model are world by world:
        ``model.body_mass`` (W J,), ``model.joint_stiffness`` (W J,), ``model.tendon.spool_radius``
        (W D,); the module ``usd_tendon`` lists all of ``model.tendon``. To change a number per
        world later, write its array::

            arms = model.tendon.arm_coef.numpy().reshape(world_count, -1)
            arms[3] *= 1.1  # world 3
            model.tendon.arm_coef.assign(arms.ravel())
            model.tendon.spool_radius.assign(radius_of_each_world)

        Solvers that copy from the model want ``notify_model_changed`` after Newton's own arrays
        were written.

        Args:
            world_count: Number of worlds W.
            overrides: Bench numbers that differ, one entry per world.
            requires_grad: Whether the arrays carry gradients.
            device: Warp device, the current one by default.
        """
        return worlds.build_model(
            self,
            world_count,
            overrides=overrides,
            requires_grad=requires_grad,
            device=device,
        )


def load_mechanism(name_or_file: str | Path) -> Mechanism:
    """Read a bench from its USD asset.

    Args:
        name_or_file: A name under ``assets/``, or the path of a USD file.

    Raises:
        InvalidAsset: The file is unreadable, or its mechanism cannot exist.
    """
    path = asset_path(name_or_file)
    stage = open_stage(path)
    with usd_errors(path):
        findings = stage_findings(stage)
    for finding in findings:
        if finding.severity == "error":
            raise InvalidAsset(f"{path}: {finding.prim}: {finding.message}. {finding.remedy}.")
    template = usd_asset.read_template(stage, path)
    joints = usd_asset.read_joints(template, path)
    return Mechanism(
        name=usd_asset.asset_name(stage, path),
        asset=path,
        joints=joints,
        tendons=usd_asset.read_tendons(stage, template, joints),
        tip=usd_asset.read_tip(template),
        gravity=usd_asset.read_gravity(template),
        template=template,
        obstacles=read_obstacles(stage, template, path),
    )

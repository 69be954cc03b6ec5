"""Read a bench from its USD asset."""

from pathlib import Path

from tendon_newton.errors import InvalidAsset, InvalidParameter, UnknownName
from tendon_newton.mechanisms.asset_library import asset_path
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.rules.stage_rules import stage_findings
from tendon_newton.mechanisms.usd import usd_asset
from tendon_newton.mechanisms.usd.stage_file import open_stage, usd_errors
from tendon_newton.mechanisms.usd.usd_obstacle import read_obstacles


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
    alone = Mechanism(
        name=usd_asset.asset_name(stage, path),
        asset=path,
        joints=joints,
        tendons=usd_asset.read_tendons(stage, template, joints),
        tip=usd_asset.read_tip(template),
        gravity=usd_asset.read_gravity(template),
        template=template,
    )
    obstacles = read_obstacles(stage, template, path)
    try:
        return alone.with_obstacles(*obstacles)
    except (InvalidParameter, UnknownName) as error:
        raise InvalidAsset(f"{path}: {error}") from None

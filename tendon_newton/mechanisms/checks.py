"""``asset check``: USD's own validators and our rules, over one asset."""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Collection
from pathlib import Path
from typing import Any

from tendon_newton.errors import InvalidAsset
from tendon_newton.mechanisms.asset_library import asset_path
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.rules.mechanism_rules import mechanism_findings
from tendon_newton.mechanisms.rules.rule_findings import STAGE, AssetFinding, about
from tendon_newton.mechanisms.rules.stage_rules import stage_findings
from tendon_newton.mechanisms.usd.stage_file import open_stage, usd_errors


def check_asset(name_or_file: str | Path, servos: Collection[str] = ()) -> tuple[AssetFinding, ...]:
    """Check an asset by every rule.

    What the finished mechanism must keep is checked only where the stage itself is free of errors.

    Args:
        name_or_file: Name under assets/, or path of a USD file or of an asset's folder.
        servos: Names that a tendon's servo may have; any where there are none.

    Raises:
        InvalidAsset: The file is unreadable.
    """
    path = asset_path(name_or_file)
    stage = open_stage(path)
    with usd_errors(path):
        findings = stage_findings(stage)
    if any(finding.rule in ("composition", "attribute") for finding in findings):
        return tuple(findings)  # USD's validators would repeat a missing layer, or stop at it
    findings = [*validator_findings(stage, path), *findings]
    if not any(finding.severity == "error" for finding in findings):
        findings += mechanism_findings(load_mechanism(path), servos)
    return tuple(findings)


def validator_findings(stage: Any, path: Path) -> list[AssetFinding]:
    """Run the validators that come with USD: layers, units, rigid bodies, joints, colliders."""
    from pxr import UsdValidation

    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    try:
        with usd_errors(path):
            errors = UsdValidation.ValidationContext(validators).Validate(stage)
    except InvalidAsset as error:
        return [
            about(STAGE, "usd:Validate").error(
                f"USD's validators must come to an end; {str(error).rstrip('.')}",
                "Mend the value that they name",
            )
        ]
    return [_from_validator(error) for error in errors]


def _from_validator(error: Any) -> AssetFinding:
    from pxr import UsdValidation

    prims = [site.GetPrim() for site in error.GetSites()]
    paths = [str(prim.GetPath()) for prim in prims if prim]
    fatal = error.GetType() == UsdValidation.ValidationErrorType.Error
    return about(paths[0] if paths else STAGE, f"usd:{error.GetName()}").found(
        "error" if fatal else "warning",
        " ".join(error.GetMessage().split()).rstrip("."),
        "Mend what USD's own validator objects to",
    )

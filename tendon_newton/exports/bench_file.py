"""The bench of a model as one USD file that refers to no other."""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.model_file import Model
from tendon_newton.effects import find_effect
from tendon_newton.errors import InvalidModelFile
from tendon_newton.mechanisms.authoring.corrected_layer import Numbers, write_corrected_layer
from tendon_newton.mechanisms.authoring.correction import Correction
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.usd.stage_file import usd_errors

SAME = 1.0e-4  # Share [1] by which a number may change on its way through USD's single precision


def write_bench(path: Path, correction: Correction, model: Model) -> None:
    """Write a corrected bench, once it reads as it was meant.

    Raises:
        InvalidModelFile: A number of the bench has no place in USD.
        InvalidOutput: The file cannot be written.
    """
    from pxr import Usd

    with tempfile.TemporaryDirectory() as draft:
        layer = Path(draft) / "layer.usda"
        write_corrected_layer(layer, correction, numbers_of(model))
        with usd_errors(layer):
            flat = Usd.Stage.Open(str(layer)).Flatten(False).ExportToString()
        written = Path(draft) / path.name
        write_text(written, flat)
        lost = lost_numbers(load_mechanism(written), correction.corrected)
    if lost:
        raise InvalidModelFile(
            f"{path.name} cannot hold all numbers of the bench {correction.asset.name}: USD has no "
            f"place for its new {', '.join(lost)}; give the bench an asset of its own"
        )
    write_text(path, flat)


def lost_numbers(written: Mechanism, meant: Mechanism) -> list[str]:
    """Return what a bench lost on its way into a file."""
    joints = ("mass", "center_of_mass", "inertia", "parent_position", "stiffness", "damping")
    tendons = ("moment_arm", "spool_radius", "force_limit", "excursion_offset")
    pairs: list[tuple[str, Any, Any]] = [("gravity", written, meant)]
    if written.tip is not None and meant.tip is not None:
        pairs.append(("point", written.tip, meant.tip))
    for names, one, other in (
        (joints, written.joints, meant.joints),
        (tendons, written.tendons, meant.tendons),
    ):
        pairs += [(name, a, b) for a, b in zip(one, other, strict=True) for name in names]
    lost = [name for name, a, b in pairs if not close(getattr(a, name), getattr(b, name))]
    return list(dict.fromkeys(lost))


def close(one: object, other: object) -> bool:
    """Tell whether two numbers, or arrays, are the same but for rounding."""
    a, b = np.asarray(one, dtype=np.float64), np.asarray(other, dtype=np.float64)
    return bool(np.abs(a - b).max() <= SAME * max(float(np.abs(b).max()), 1.0e-9))


def numbers_of(model: Model) -> Numbers:
    """Return the numbers of a model's effects with their units."""
    return {
        effect.name: {
            parameter.name: (float(effect.values[parameter.name]), parameter.unit)
            for parameter in find_effect(effect.name).parameters
            if parameter.name in effect.values
        }
        for effect in model.effects
    }

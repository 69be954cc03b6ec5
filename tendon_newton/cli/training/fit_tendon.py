"""Find how much a tendon gives and how loose it is, from recordings that show the tip.

  tendon-newton fit-tendon recordings --force networks/simulation-0.safetensors --out fitted
  tendon-newton train-policy --force fitted/model.toml --randomise none --device cuda --out policy

A force network knows what a servo pulls with. The network does not know where the tip is at an
angle of the motor: the string stretches, and was not quite taut when it was homed. On a bench with
a load cell and a camera both are plain to see, and are all that a policy on a learned force needs
besides the network. OUT gets model.toml, the given force with tendon_compliance and tendon_slack,
and tendon.json with their 95 % intervals and the error before and after. The two effects enter the
model if each train recording is nearer with the numbers that the others give. Test recordings only
report.
"""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

if TYPE_CHECKING:
    from tendon_newton.data.model_file import Model
    from tendon_train.tendon.tendon_fit import TendonFit


@dataclass(frozen=True, kw_only=True)
class FitTendonConfig:
    """Find how much a tendon gives and how loose it is, from recordings that show the tip."""

    dataset: Annotated[Path, tyro.conf.Positional]
    """Folder with dataset.toml and recordings of a finger with force, tip_x and tip_z; others are
    left out. Test recordings only report the error."""
    out: Path  # Folder for the results; made if it is not there.
    force: str = "ideal"
    """Force model: ideal, a model file (.toml), or a force network (.safetensors)."""


def main(config: FitTendonConfig) -> None:
    """Fit, write and print what was found."""
    from tendon_newton.data.files.json_file import write_json
    from tendon_newton.data.files.output_folder import make_folder
    from tendon_newton.device_code.quiet import quiet_warp

    quiet_warp()

    from tendon_newton.data.dataset import load_dataset
    from tendon_newton.data.model_file import write_model
    from tendon_train.tendon.tendon_fit import fit_tendon

    force = Path(config.force)
    out = make_folder(config.out, config.dataset, force if force.is_file() else None)
    dataset = load_dataset(config.dataset, require_test=False)
    fit, model = fit_tendon(dataset, read_model(config.force))
    write_model(out / "model.toml", model)
    write_json(out / "tendon.json", fit.to_json())
    print(summary(fit))
    print(
        f"wrote {out / 'model.toml'} and tendon.json; next: tendon-newton train-policy --force "
        f"{shlex.quote(str(out / 'model.toml'))} --randomise none --out policy"
    )


def read_model(force: str) -> Model:
    """Return the model of a word or a file, whole."""
    from tendon_newton.data.model_file import load_model
    from tendon_newton.mechanisms.loading import load_mechanism
    from tendon_train.policy.worlds.force_model import open_force_model

    if Path(force).suffix == ".toml":
        return load_model(Path(force))
    return open_force_model(force, load_mechanism("finger")).model


def summary(fit: TendonFit) -> str:
    """Return what was found in words."""
    k, s = fit.stiffness, fit.slack
    rows = "held-out rows" if fit.held_out else "the same rows, as none are held out"
    unseen = "train recordings that the fit did not see"
    verdict = "" if fit.helps else f"\n  nothing is gained on {unseen}: the model stays as it was"
    return (
        f"{fit.bench}, {fit.rows:,} rows with a taut tendon:\n"
        f"  stiffness  {k.value:.0f} N/m [{k.low:.0f}, {k.high:.0f}]\n"
        f"  slack      {1e3 * s.value:.2f} mm [{1e3 * s.low:.2f}, {1e3 * s.high:.2f}]\n"
        f"  wound in beyond what the finger takes, RMS on {rows}: "
        f"{1e3 * fit.error_before:.2f} mm before, {1e3 * fit.error_after:.2f} mm after"
        f"{verdict}"
    )

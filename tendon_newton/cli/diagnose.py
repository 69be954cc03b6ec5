"""Name what a model gets wrong about measured data, extend it, and measure the gain."""

from __future__ import annotations

import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

if TYPE_CHECKING:
    from tendon_newton.data.dataset import Dataset
    from tendon_newton.diagnosis.result import Diagnosis


@dataclass(frozen=True, kw_only=True)
class DiagnoseConfig:
    """Name what a model gets wrong about measured data.

    Writes DIR/report.html (for people), DIR/diagnosis.json (for programs), DIR/model.toml (the
    extended model, usable as the next --model) and DIR/identified.usda (what was found about the
    mechanism, above its asset). The verdict is one of: no_gap, explained, partly_explained,
    unexplained.
    """

    dataset: Annotated[Path, tyro.conf.Positional]
    """Folder with dataset.toml and its recordings; test recordings only report the error."""
    out: Path
    """Folder for the results; made if it is not there."""
    model: Path | None = None
    """Model file to start from; by default model.toml beside the recordings."""
    hold_out: float | None = None
    """Share of each recording, from its end, that only reports the error: for a dataset without
    test recordings, such as one long log of a deployment."""


def main(config: DiagnoseConfig) -> None:
    """Diagnose and write what was found."""
    from tendon_newton.data.files.result_folder import make_folder
    from tendon_newton.data.model_file import load_model, write_model
    from tendon_newton.device_code.quiet import quiet_warp

    quiet_warp()
    dataset = read_dataset(config)
    model = load_model(model_file(config))
    out = make_folder(config.out)

    from tendon_newton.diagnosis.diagnose import diagnose
    from tendon_newton.diagnosis.identified import write_identified
    from tendon_newton.diagnosis.reporting.report import Origin, write_report
    from tendon_newton.diagnosis.result import write_diagnosis

    diagnosis, evidence = diagnose(dataset, model, progress=lambda text: print(f"  {text} ..."))
    write_diagnosis(out / "diagnosis.json", diagnosis)
    write_model(out / "model.toml", diagnosis.model)
    origin = Origin(dataset=config.dataset, command=shlex.join(["tendon-newton", *sys.argv[1:]]))
    write_report(out / "report.html", diagnosis, evidence, origin)
    layers = write_identified(out, diagnosis, dataset)
    print(summary(diagnosis))
    print(f"\n  report          {out / 'report.html'}")
    print(f"  extended model  {out / 'model.toml'}")
    print(f"  for programs    {out / 'diagnosis.json'}")
    print(f"  for USD         {', '.join(map(str, layers))}")


def model_file(config: DiagnoseConfig) -> Path:
    """Return the model file to start from: the one that is named, or the dataset's own."""
    from tendon_newton.errors import InvalidModelFile

    if config.model is not None:
        return config.model
    beside = config.dataset / "model.toml"
    if not beside.is_file():
        raise InvalidModelFile(
            f"{beside}: a diagnosis starts from a model; there is none. Name one with --model, or "
            "write this file: the verbs collect and import do, docs/model_file.md tells how"
        )
    return beside


def read_dataset(config: DiagnoseConfig) -> Dataset:
    """Read the recordings, and cut those of a dataset that holds none out."""
    from tendon_newton.data.dataset import Dataset, load_dataset
    from tendon_newton.errors import InvalidParameter
    from tendon_newton.identification.cutting import hold_out

    if config.hold_out is None:
        return load_dataset(config.dataset)
    if not 0.05 <= config.hold_out <= 0.8:
        raise InvalidParameter(f"--hold-out must be 0.05 to 0.8; it is {config.hold_out:g}")
    whole = load_dataset(config.dataset, require_test=False)
    if whole.test:
        raise InvalidParameter(
            f"--hold-out cuts recordings of a dataset that holds none out; {config.dataset} has "
            f'{len(whole.test)} with split = "test"'
        )
    train, test = hold_out(whole.train, config.hold_out)
    return Dataset(path=whole.path, train=train, test=test)


VERDICTS = {
    "no_gap": "no gap: what the model leaves is noise, as far as this data can tell",
    "explained": "explained: the named causes account for the gap",
    "partly_explained": "partly explained: the named causes are real, and structure remains",
    "unexplained": "unexplained: there is a gap, and no effect of the catalogue accounts for it",
}


def summary(diagnosis: Diagnosis) -> str:
    """Return the result as a table for a terminal."""
    from tendon_newton.data.parameters import with_unit
    from tendon_newton.diagnosis.reporting.report_doubts import doubts

    force = diagnosis.scale
    lines = ["", VERDICTS[diagnosis.verdict], ""]
    for effect in diagnosis.effects:
        numbers = ", ".join(
            f"{name} = {with_unit(f'{p.value:.4g}', p.unit)} [{p.ci95[0]:.4g}, {p.ci95[1]:.4g}]"
            for name, p in effect.parameters.items()
        )
        lines.append(f"  {effect.name:26s} {numbers}")
        if effect.indistinguishable_from:
            lines.append(
                f"  {'':26s} or {', '.join(effect.indistinguishable_from)}: not told apart; "
                "see the verb experiment"
            )
    lines += ["", "  held-out error           before      after"]
    for label, name, scale, unit in (
        ("motor angle, RMS", "theta_rmse", 1e3, "mrad"),
        ("motor angle, mean abs.", "theta_mae", 1e3, "mrad"),
        (f"{force.force_name}, RMS", "force_rmse", 1.0, force.force_unit),
    ):
        before, after = getattr(diagnosis.baseline, name), getattr(diagnosis.extended, name)
        if before is not None and after is not None:
            lines.append(f"  {label:22s} {scale * before:8.4g}   {scale * after:8.4g} {unit}")
    if diagnosis.next_steps:
        lines += ["", "  what came closest, and what to do next:"]
        lines += [f"  - {step}" for step in diagnosis.next_steps]
    lines += [f"  note: {note}" for note in (*doubts(diagnosis), *diagnosis.notes)]
    return "\n".join(lines)

"""Carry an identified model into another simulator."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro


@dataclass(frozen=True, kw_only=True)
class ExportConfig:
    """Carry an identified model into another simulator.

    Writes the target's files, replay.json, and a README.md that says how to load them, how far they
    stray from our own simulation of the same commands, and what they leave out.
    """

    model: Annotated[Path, tyro.conf.Positional]
    """Model file, or a diagnosis: its folder or its diagnosis.json."""
    to: str
    """Target: mujoco or bam; the table in docs/export.md says what each can hold."""
    out: Path
    """Folder for the files; made if it is not there."""
    bench: str | None = None
    """Bench to export; by default that of the recordings, or the finger."""
    dataset: Path | None = None
    """Dataset whose recordings are replayed; by default some steps and a sine."""
    trust: bool = False
    """Trust the network's file from now on: it is a program that runs with your rights."""


def main(config: ExportConfig) -> None:
    """Write the files and say how far they stray."""
    from tendon_newton.data.dataset import load_dataset
    from tendon_newton.data.files.result_folder import make_folder
    from tendon_newton.data.model_file import load_model
    from tendon_newton.device_code.quiet import quiet_warp
    from tendon_newton.errors import InvalidParameter
    from tendon_newton.exports import find_export
    from tendon_newton.exports.page import measure, write_page

    quiet_warp()
    target = find_export(config.to)
    model = load_model(model_path(config.model))
    recordings = []
    if config.dataset is not None:
        dataset = load_dataset(config.dataset, require_train=False, require_test=False)
        recordings = [r for r in (*dataset.train, *dataset.test) if r.command is not None]
    benches = sorted({recording.bench for recording in recordings})
    bench = config.bench or (benches[0] if benches else "finger")
    if benches and config.bench is None and len(benches) > 1:
        raise InvalidParameter(
            f"--bench must say which bench is exported; the dataset has {', '.join(benches)}"
        )
    recordings = [recording for recording in recordings if recording.bench == bench]

    from tendon_newton.simulation.hosts.replay import bench_of

    mechanism = bench_of(bench, model)
    out = make_folder(config.out)
    exported = target.write(out, mechanism, model)
    fidelity = measure(target, exported, mechanism, model, recordings, trust=config.trust)
    title = f"{bench}, for {config.to}"
    write_page(out, title, exported, fidelity)
    for way, departure in fidelity.replays.items():
        print(f"  {way:24s} {departure.text}")
    for way, costs in fidelity.costs.items():
        print(f"  {way} leaves out: {', '.join(costs)}")
    print(f"\nwrote {', '.join(path.name for path in exported.files)}, README.md to {out}")


def model_path(path: Path) -> Path:
    """Return the model file of a diagnosis, or the path itself."""
    if path.is_dir():
        return path / "model.toml"
    if path.suffix == ".json":
        return path.parent / "model.toml"
    return path

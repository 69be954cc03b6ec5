"""Replay a dataset's commands through a model in closed loop.

Writes one CSV per recording (t, theta_d, theta, theta_dot, force and the tip where the bench has
one) and, beside it, a picture of measured and simulated signals.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from tendon_newton.cli.duration import TimeLeft
from tendon_newton.data.files.output_folder import make_folder
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.errors import InvalidParameter

if TYPE_CHECKING:
    from tendon_newton.data.recording import Recording
    from tendon_newton.simulation.hosts.rollout import Trajectory

AT_ONCE = 8  # Recordings that are simulated side by side before the time left is told.


@dataclass(frozen=True, kw_only=True)
class SimulateConfig:
    """Which recordings, which model, and where to."""

    dataset: Annotated[Path, tyro.conf.Positional]  # Folder with dataset.toml and its recordings.
    model: Path
    """What moves the benches: a model file (.toml), a diagnosis of them (its folder), or a known
    servo."""
    out: Path  # Folder for the results; made if it is not there.
    seconds: float = 20.0  # Beginning of each recording that is simulated [s]; inf takes all.
    time_step: float | None = None
    """Longest step of the integrator [s]; by default 0.125 ms."""
    network: str = "torchscript"
    """How the force network of a learned actuator runs: torchscript, or fused (a Transformer as one
    kernel, checked against TorchScript when loaded; other networks run as TorchScript)."""
    trust: bool = False
    """Trust the network's file from now on: it is a program that runs with your rights."""
    plots: bool = True  # Whether to draw a picture per recording.


def main(config: SimulateConfig) -> None:
    """Simulate and write trajectories and pictures."""
    from tendon_newton.data.dataset import load_dataset

    if config.time_step is not None and not 1.0e-6 <= config.time_step <= 0.01:
        raise InvalidParameter(
            f"--time-step must be between 1e-6 and 0.01 s; it is {config.time_step:g}"
        )
    if not config.seconds > 0.0:
        raise InvalidParameter(f"--seconds must be above 0; it is {config.seconds:g}")
    quiet_warp()

    from tendon_newton.diagnosis.diagnosed_bench import open_model
    from tendon_newton.identification.cutting import beginning
    from tendon_newton.mechanisms.loading import load_mechanism

    dataset = load_dataset(config.dataset, require_train=False, require_test=False)
    whole = (*dataset.train, *dataset.test)
    benches = dict.fromkeys(recording.bench for recording in whole)
    model = open_model(config.model, [load_mechanism(bench) for bench in benches])
    out = make_folder(config.out, config.dataset)

    from tendon_newton.simulation.hosts.replay import replay

    options: Any = {"network": config.network, "trust": config.trust}
    if config.time_step is not None:
        options["time_step"] = config.time_step
    recordings = [beginning(r, config.seconds) if r.duration > config.seconds else r for r in whole]
    if any(recording.duration > config.seconds for recording in whole):
        print(f"  the first {config.seconds:g} s of each recording; --seconds inf takes all")
    told = TimeLeft(sum(recording.duration for recording in recordings))
    for first in range(0, len(recordings), AT_ONCE):
        members = recordings[first : first + AT_ONCE]
        for recording, trajectory in zip(members, replay(members, model, **options), strict=True):
            write_result(config, recording, trajectory)
        told(sum(recording.duration for recording in members))
    print(f"\nwrote {len(recordings)} recordings to {out}")


def write_result(config: SimulateConfig, recording: Recording, trajectory: Trajectory) -> None:
    """Write a simulation, with its picture, and print its errors."""
    from tendon_newton.data.files.picture import save
    from tendon_newton.data.formats.csv_file import write_csv
    from tendon_newton.data.recording_plot import recording_figure
    from tendon_newton.simulation.hosts.replay import simulated_recording

    path = config.out / Path(recording.name).with_suffix(".csv").name
    write_csv(path, simulated_recording(recording, trajectory))
    if config.plots:
        save(recording_figure(recording, trajectory), path.with_suffix(".png"))
    print(f"  {path.name:32s} {errors_text(recording, trajectory)}")


def errors_text(recording: Recording, trajectory: Trajectory) -> str:
    """Return how far a simulation is from its recording, in rows that it can know."""
    from tendon_newton.data.root_mean_square import rms
    from tendon_newton.simulation.hosts.timeline import make_timeline

    known = make_timeline(recording).trusted
    theta = rms((recording.motor_position - trajectory.motor_position)[known])
    text = f"theta {1e3 * theta:8.3f} mrad RMS"
    if recording.force is not None:
        text += f"   force {rms((recording.force - trajectory.force)[known]):7.4f} N RMS"
    return text if known.all() else f"{text}, without {(~known).sum()} rows after gaps"

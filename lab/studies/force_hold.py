"""What a simulation makes of a force network between two queries, in closed loop, side by side.

  python -m lab.studies.force_hold reproduction

takes the benches and the networks of `tendon-newton reproduce` and replays the sinusoids of the
sim-to-real experiment on the nominal finger: asked 20 times a second or 80 (four interleaved
histories, as the windows of the training), held or answering to the shaft, trained along measured
motion or for the loop. Each number is a median over the benches, with the least and the greatest.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
import tyro

from tendon_lab.force_scoring.ideal_baseline import PAPER_GAIN
from tendon_lab.reproduction.closed_loop import Replayed, replayed
from tendon_lab.reproduction.physical import SPOOL_RADIUS
from tendon_lab.reproduction.steps.network_stage import learned_model
from tendon_lab.reproduction.steps.tip_stage import SINES
from tendon_lab.reproduction.unit import Unit
from tendon_newton.actuators.networks.artifact import NetworkFile, load_network
from tendon_newton.actuators.networks.torchscript import TorchScriptQuery
from tendon_newton.data.cards.force_network_card import PLAIN_HOLD, HoldLaw
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.network_source import NetworkSource
from tendon_newton.simulation.hosts.replay import simulated_recording
from tendon_newton.simulation.hosts.rollout import Rollout
from tendon_train.actuator.training_config import SERVO_LIMIT

TIME_STEP = 5.0e-4  # s
FASTEST = 5.0
"""Faster than this [Hz] a force chatters; the sinusoids have 0.5 Hz, a motion's creases a few."""
PURPOSES = {"prediction": "along motion", "simulation": "for the loop"}
FASTER = (1, 4)  # Queries in one period of the network [1]


@dataclass(frozen=True, kw_only=True)
class HoldConfig:
    """What is compared."""

    reproduction: Annotated[Path, tyro.conf.Positional]
    """Folder of a reproduction, its networks trained."""
    network: str = "transformer{}-paper-0"
    """Name of the networks' files; the braces stand for what they are for."""
    out: Path | None = None  # JSON file for all numbers


class Interleaved(torch.nn.Module):
    """A network that sees every n-th sample of a longer history.

    Args:
        network: Maps windows, shape (W, H, 3), to forces [N], shape (W,).
        every: n.
    """

    def __init__(self, network: Any, every: int) -> None:
        super().__init__()
        self.network = network
        self.every = every

    def forward(self, window: torch.Tensor) -> torch.Tensor:
        """Return forces [N] of windows of n (H - 1) + 1 samples."""
        return self.network.last_query(window[:, :: self.every].contiguous())


def main(config: HoldConfig) -> None:
    """Print the table."""
    numbers: dict[str, dict[str, list[float]]] = {}
    for folder in sorted((config.reproduction / "data").glob("unit_*")):
        unit = Unit(name=folder.name, folder=folder)
        for name, runs in of_unit(unit, config):
            row = numbers.setdefault(name, {})
            for run, sine in zip(runs, SINES.values(), strict=True):
                row.setdefault(f"tip {sine} [mm]", []).append(1.0e3 * run.tip_error)
                row.setdefault(f"chatter {sine} [N]", []).append(chatter(run))
    print("| " + " | ".join(["", *next(iter(numbers.values()))]) + " |")
    for name, row in numbers.items():
        cells = [f"{np.median(v):.2f} ({min(v):.2f} to {max(v):.2f})" for v in row.values()]
        print("| " + " | ".join([name, *cells]) + " |")
    if config.out is not None:
        config.out.write_text(json.dumps(numbers, indent=1) + "\n")


def of_unit(unit: Unit, config: HoldConfig) -> Iterator[tuple[str, list[Replayed]]]:
    """Yield what is compared on one bench, by name."""
    recordings = [unit.find("finger", kind) for kind in SINES]
    yield "bench", [Replayed(recording=r, simulated=r) for r in recordings]
    values = {"gain": PAPER_GAIN, "spool_radius": SPOOL_RADIUS}
    ideal = Model(actuator=NamedValues(name="ideal", values=values))
    yield "ideal source, 4.2 N/rad", replayed(recordings, ideal, time_step=TIME_STEP)
    networks = config.reproduction / "networks" / unit.name
    for purpose, words in PURPOSES.items():
        middle = "" if purpose == "prediction" else f"-{purpose}"
        file = load_network(networks / f"{config.network.format(middle)}.pt", trust=True)
        for every in FASTER:
            for hold in (PLAIN_HOLD, file.card.hold):
                how = "held" if hold == PLAIN_HOLD else "answering"
                name = f"trained {words}, {file.card.rate * every:g} Hz, {how}"
                yield name, in_loop(unit, file, every, hold)


def in_loop(unit: Unit, file: NetworkFile, every: int, hold: HoldLaw) -> list[Replayed]:
    """Replay the sinusoids of a bench with its network."""
    recordings = [unit.find("finger", kind) for kind in SINES]
    card = file.card
    query = TorchScriptQuery(
        Interleaved(file.module, every),
        window=every * (card.window - 1) + 1,
        rate=every * card.rate,
        limit=SERVO_LIMIT,
        hold=hold,
    )
    rollout = Rollout(
        load_mechanism("finger"),
        recordings,
        actuator="learned",
        force=NetworkSource(query),
        spool_radius=SPOOL_RADIUS,
        time_step=TIME_STEP,
    )
    runs = rollout.run(rollout.base_vectors(learned_model(file.path))[None])[0]
    return [
        Replayed(recording=recording, simulated=simulated_recording(recording, run))
        for recording, run in zip(recordings, runs, strict=True)
    ]


def chatter(run: Replayed) -> float:
    """Return the RMS of what is fast in a force [N]."""
    assert run.simulated.force is not None
    force: Array = run.simulated.force[run.late, 0]
    spectrum = np.fft.rfft(force)
    step = float(np.median(np.diff(run.recording.time)))
    spectrum[np.fft.rfftfreq(len(force), step) < FASTEST] = 0.0
    return float(np.sqrt(np.mean(np.fft.irfft(spectrum, len(force)) ** 2)))


if __name__ == "__main__":
    torch.set_num_threads(1)
    main(tyro.cli(HoldConfig, description=__doc__))

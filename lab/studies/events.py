"""Events in recordings of virtual units: a slip, a skip, a knock, a dip; found in time and size?

The models are the answers of `lab.studies.days`. Each unit makes six runs in which nothing
happens, by which events are told from what the model leaves, as many clean runs as there are with
an event, and these.
"""

import random
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from lab.studies.unit_faults import SETTINGS, driven
from lab.studies.unit_score import rate
from lab.studies.units import read
from tendon_hardware.collection.excitation_plan import PlannedRun
from tendon_hardware.virtual_bench import FaultEvent, LockstepBench
from tendon_hardware.virtual_bench.physics.encoder import COUNTS_PER_RADIAN
from tendon_hardware.virtual_bench.physics.obstacle import HAND, BenchObstacle
from tendon_hardware.virtual_bench.physics.tendon import BenchTendon
from tendon_hardware.virtual_bench.physics.unit import draw_unit
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.model_file import load_model
from tendon_newton.data.recording import Recording
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.diagnosis.in_time.log_events import Event, calm_day, find_events

Row = dict[str, Any]
KINDS = ("slip", "skip", "knock", "dip")
BENCH, DURATION, EXCITATIONS = "finger", 20.0, ("random_steps", "sine", "ramps")
CALM = 6  # Runs by which events are told from what a model leaves
SIZES = {"slip": (0.001, 0.005), "skip": (0.1, 0.5), "knock": (2.0, 6.0), "dip": (0.2, 0.42)}
"""Least and greatest size [m, rad, N, 1]. A deeper dip would restart the servo."""
LENGTHS = {"knock": (0.15, 0.4), "dip": (0.5, 2.0)}  # Least and greatest length [s]
NEAR, SHARE = 0.05, 0.1  # How far a start [s] and a size [1] may be off


class Knock(BenchObstacle):
    """A force that closes the finger for a while, and rises and falls in 20 ms.

    Args:
        force: Greatest force along the tendon's path [N].
        begin: Instant [s].
        length: Its time [s].
    """

    def __init__(self, force: float, begin: float, length: float) -> None:
        super().__init__()
        self.force, self.begin, self.length = force, begin, length
        self.now = HAND

    def advance(self, time: float) -> None:
        """Stay there: the force itself begins and ends."""

    def push(self, excursion: float, rate: float, time: float) -> float:
        """Return the force against the tendon [N]."""
        since = time - self.begin
        return -self.force * max(0.0, min(1.0, since / 0.02, (self.length - since) / 0.02))


def planted(rng: random.Random, kind: str) -> Row:
    """Draw an event: its kind, start, size and length."""
    low, high = SIZES[kind]
    size = rng.uniform(low, high) * (rng.choice((-1.0, 1.0)) if kind == "skip" else 1.0)
    length = rng.uniform(*LENGTHS[kind]) if kind in LENGTHS else None
    start = rng.uniform(4.0, DURATION - 5.0)
    return {"kind": kind, "start": start, "size": size, "length": length, "happened": False}


def befall(event: Row, bench: LockstepBench, since: float) -> None:
    """Let an event happen at the first row at which it is due."""
    if event["happened"] or since < event["start"]:
        return
    event |= {"happened": True, "start": since}
    plant, size = bench.plant, event["size"]
    if event["kind"] == "slip":
        constants = plant.lines[0].constants.tendon
        loose = BenchTendon(replace(constants, slack=constants.slack + size))
        loose.passed = plant.tendon.passed
        plant.tendon = plant.lines[0].tendon = loose
    elif event["kind"] == "skip":
        plant.encoder.home += round(size * COUNTS_PER_RADIAN)
    elif event["kind"] == "knock":
        plant.obstacle = Knock(size, plant.time, event["length"])
    else:
        voltage = (1.0 - size) * plant.lines[0].constants.servo.supply_voltage
        now, length = plant.time, event["length"]
        bench.plan(FaultEvent(name="supply_dip", start=now, duration=length, voltage=voltage))


def recorded(unit: int, name: str, event: Row | None = None) -> Recording:
    """Record one run of a unit, with or without an event; a row has the tension and the voltage."""
    excitation = random.Random(f"excitation {name}").choice(EXCITATIONS)
    run = PlannedRun(name=name, bench=BENCH, excitation=excitation, duration=DURATION)
    voltage: dict[float, float] = {}

    def look(bench: LockstepBench, since: float) -> None:
        voltage[since] = round(bench.state().voltage, 1)  # a register's tenths
        if event is not None:
            befall(event, bench, since)

    position, force, _ = driven(run, draw_unit(BENCH, unit), look)
    rate = SETTINGS.rate
    time = np.arange(len(position)) / rate
    given = np.arange(len(position)) // SETTINGS.divider * SETTINGS.divider
    return Recording(
        name=name,
        bench=BENCH,
        time=time,
        command=run.command(SETTINGS.seed, rate)[given, None],
        motor_position=position[:, None],
        motor_velocity=np.gradient(position, time)[:, None],
        force=force[:, None],
        voltage=np.array([volts for since, volts in voltage.items() if since >= 0.0]),
        start="first_row",
    )


def events_of(unit: int, days: Path, out: Path, runs: int) -> Row:
    """Record a unit's runs and look for their events, unless that is done."""
    file = out / f"events_{unit}.json"
    if file.exists():
        return read(file)
    quiet_warp()
    rng = random.Random(f"events {unit}")
    calm = [recorded(unit, f"calm_{unit}_{k}") for k in range(CALM)]
    truth: dict[str, Row] = {}
    later: list[Recording] = []
    for k in range(runs):
        event = planted(rng, KINDS[k % len(KINDS)])
        later.append(recorded(unit, f"event_{unit}_{k}", event))
        truth[later[-1].name] = event
    later += [recorded(unit, f"clean_{unit}_{k}") for k in range(runs)]
    model = load_model(days / f"unit_{unit}" / "answer" / "model.toml")
    found = find_events(calm_day(calm, model), later, model)
    rows = [
        judged(truth.get(each.name), [e for e in found if e.recording == each.name], each.name)
        for each in later
    ]
    write_json(file, {"unit": unit, "runs": rows})
    return {"unit": unit, "runs": rows}


def judged(truth: Row | None, found: Sequence[Event], name: str) -> Row:
    """Hold what was found in a run against what happened; a least size must not be too large."""
    row: Row = {"run": name, "truth": truth, "found": [asdict(event) for event in found]}
    if truth is None:
        return row | {"silent": not found}
    own = next((event for event in found if event.kind == truth["kind"]), None)
    share = 0.0 if own is None else own.size / truth["size"]
    least = own is not None and own.at_least
    size = {"holds": share <= 1.0 + SHARE} if least else {"in_size": abs(share - 1.0) <= SHARE}
    return row | {
        "kind": truth["kind"],
        "detected": bool(found),
        "named": own is not None and len(found) == 1,
        "in_time": own is not None and abs(own.start - truth["start"]) <= NEAR,
        **size,
    }


def summary(runs: Sequence[Row]) -> Row:
    """Return the rates of all runs, and of each kind."""
    events = [run for run in runs if run["truth"] is not None]
    out: Row = {"silent": rate(sum(r["silent"] for r in runs if "silent" in r),
                               sum("silent" in r for r in runs))}  # fmt: skip
    for key in ("detected", "named", "in_time", "in_size", "holds"):
        for kind in ("all", *KINDS):
            own = [run[key] for run in events if kind in ("all", run["kind"]) and key in run]
            out[f"{key}, {kind}"] = rate(sum(own), len(own))
    return out

"""Deployments one after the other, with faults of all kinds: nothing leaks, every log is complete.

Faults that a run survives come and go at random; in the end one comes that it must not survive, or
its time is over. A log is complete where it is read to its end, says why the run ended, and holds
as many readings of the servo as were made.
"""

import gc
import random
import resource
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tendon_hardware.benches.bench import Bench
from tendon_hardware.deployment.deploy_settings import DeploySettings
from tendon_hardware.stop_request import StopRequest
from tendon_hardware.virtual_bench.faults import ALERT_BITS
from tendon_newton.data.formats.mcap_file import McapReading, read_session
from tendon_newton.data.formats.topic_mapping import STATE_TOPIC
from tests.faults import injections as on
from tests.faults.cases import fail, now_and_then
from tests.faults.injections import FULL, LONG, let
from tests.hardware.deploy.policies import policy_of
from tests.hardware.deploy.runs import Flight, closing

Fault = Callable[[Bench, StopRequest], None]

EPISODE = (20.0, 240.0)  # Length of a deployment [s]
PAUSE = (1.0, 8.0)  # Between two passing faults [s]
SETTLING = 5  # Deployments before memory is looked at: caches fill
LEAK_MAX = 20.0  # Growth of the memory from then on that is none [MB]: the allocator's own scatter

PASSING: dict[str, Fault] = {
    "noise": on.worse(dropped_replies=0.02, corrupted_replies=0.02, line_noise=0.05),
    "garbled lines": on.worse(garbled_lines=0.1, lost_lines=0.05),
    "late answers": on.worse(extra_latency=0.002),
    "quiet": on.worse(),
    "spike": let("cell_spike"),
    "saturated reading": let("cell_spike", counts=FULL),
    "silent cell": let("cell_silence", duration=0.15),
    "deaf moment": let("cell_deaf", duration=0.1),
    "busy computer": on.stall,
}
"""Faults that a run survives."""
ENDING: dict[str, Fault] = {
    **{f"alert {name}": let("alert", alert=name) for name in ALERT_BITS},
    "spool slips": on.slip,
    "supply sags": on.sag,
    "supply rises": on.surge,
    "restart": let("reboot"),
    "unplugged": let("unplug", duration=LONG),
    "silent servo": on.silence,
    "two servos": on.worse(doubled_replies=1.0),
    "tension": on.load,
    "hot motor": on.heat,
    "stuck cell": on.stuck(),
    "saturated cell": on.stuck(FULL),
    "silent cell for good": let("cell_silence", duration=LONG),
    "shutdown": on.terminate,
}
"""Faults that end it."""


class Weather:
    """Lets faults come and go in the steps of a pilot.

    Args:
        end: When one comes that ends the run, since the bench was opened [s]; none may.
    """

    def __init__(self, rng: random.Random, end: float | None, seen: Counter[str]) -> None:
        self._rng = rng
        self._end = end
        self._seen = seen
        self._next = rng.uniform(*PAUSE)
        self.bad = ""  # How the policy goes wrong, if it does

    def blow(self, bench: Bench, stop: StopRequest) -> None:
        """Let happen what is due."""
        now = bench.clock.now()
        if self._end is not None and now >= self._end:
            self._end = None
            name = self._rng.choice([*ENDING, "policy raises", "policy gives NaN"])
            self._seen[name] += 1
            if name in ENDING:
                ENDING[name](bench, stop)
            else:
                self.bad = name
        elif now >= self._next:
            self._next = now + self._rng.uniform(*PAUSE)
            name = self._rng.choice(list(PASSING))
            self._seen[name] += 1
            PASSING[name](bench, stop)


class Changeable:
    """A policy that closes the finger until the weather spoils it."""

    def __init__(self, weather: Weather) -> None:
        self._weather = weather
        self._bad = {"policy raises": fail(), "policy gives NaN": now_and_then()}

    def __call__(self, sample: object) -> object:
        """Act."""
        bad = self._bad.get(self._weather.bad)
        return closing(sample) if bad is None else bad()  # pyright: ignore


def episode(seed: int, path: Path, length: float, seen: Counter[str]) -> float:
    """Deploy once and require a complete log; return how long it ran on its own clock [s]."""
    rng = random.Random(seed)
    end = None if rng.random() < 0.2 else 1.0 + rng.uniform(0.3, 0.95) * length
    weather = Weather(rng, end, seen)
    flight = Flight(
        path=path,
        settings=DeploySettings(duration=length),
        policy=policy_of(Changeable(weather)),
        in_step=True,
        often=True,
        after=0.0,
        fault=weather.blow,
    )
    outcome = flight.fly()
    assert not flight.duty_after, outcome.ended
    session = read_session(path)
    assert session["ended"] == outcome.ended
    assert int(session["rows"]) == outcome.rows
    with path.open("rb") as file:
        messages = McapReading(file, path.name).messages({STATE_TOPIC})
        assert sum(1 for _ in messages) == outcome.rows
    return outcome.pacing.ticks / 80.0


def soak(hours: float, tell: Callable[[str], None], seed: int = 0) -> dict[str, Any]:
    """Deploy until so much simulated time has passed [h], and require that nothing leaks.

    Returns:
        A row of the exam.
    """
    seen: Counter[str] = Counter()
    ended: Counter[str] = Counter()
    passed, count = 0.0, 0
    rng = random.Random(seed)
    sizes: list[tuple[float, int]] = []
    with TemporaryDirectory() as folder:
        while passed < 3600.0 * hours:
            path = Path(folder) / f"{count}.mcap"
            length = min(rng.uniform(*EPISODE), max(3600.0 * hours - passed, EPISODE[0]))
            passed += episode(rng.randrange(1 << 30), path, length, seen)
            ended[read_session(path)["ended"].split(";")[0][:40]] += 1
            path.unlink()
            count += 1
            gc.collect()
            sizes.append((resident(), len(list(Path("/proc/self/fd").iterdir()))))
            if count % 10 == 0:
                tell(f"{count} deployments, {passed:.0f} s: {sizes[-1][0]:.1f} MB")
        left = list(Path(folder).iterdir())
    settled = sizes[min(SETTLING, len(sizes) - 1) :]
    growth = settled[-1][0] - settled[0][0]
    tell(
        f"soak: {count} deployments, {passed / 3600.0:.2f} h simulated, {sum(seen.values())} "
        f"faults of {len(seen)} kinds; memory {settled[0][0]:.1f} MB after {SETTLING}, "
        f"{settled[-1][0]:.1f} MB at the end; open files {settled[0][1]}, then {settled[-1][1]}"
    )
    tell("\n".join(f"  {number:4d} {name}" for name, number in seen.most_common()))
    assert left == []
    assert growth <= LEAK_MAX, f"{growth:.1f} MB more"
    assert settled[-1][1] == settled[0][1]
    return {
        "fault": "faults that come and go",
        "minutes": round(passed / 60.0, 1),
        "faults": sum(seen.values()),
        "runs": count,
        "acted": count,
        "memory_mb": [round(settled[0][0], 1), round(settled[-1][0], 1)],
        "open_files": [settled[0][1], settled[-1][1]],
    }


def resident() -> float:
    """Return the resident memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 1e6

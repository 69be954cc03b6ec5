"""What can go wrong on a virtual bench in lockstep, as functions that let it happen now."""

import os
import signal
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from typing import Any

from tendon_hardware.benches.bench import Bench
from tendon_hardware.stop_request import StopRequest
from tendon_hardware.virtual_bench import FaultEvent, Faults
from tendon_hardware.virtual_bench.physics.load_cell import GRAVITY

FULL = 2**23 - 1  # Greatest counts of the load cell's converter
LONG = 100.0  # Longer than any run [s]


def plant(bench: Bench) -> Any:
    """Return what the bench is made of."""
    return bench.controls.plant  # pyright: ignore


def let(name: str, **words: Any) -> Callable[[Bench, StopRequest], None]:
    """Let an event happen now."""

    def happen(bench: Bench, stop: StopRequest) -> None:
        bench.controls.plan(FaultEvent(name=name, start=bench.clock.now(), **words))  # pyright: ignore

    return happen


def slip(bench: Bench, stop: StopRequest) -> None:
    """Let the spool spin out of its window, as it does when the tendon breaks."""
    plant(bench).motor.angle = 7.5


def sag(bench: Bench, stop: StopRequest) -> None:
    """Let the supply sag below what the servo needs, but not so far that it restarts."""
    plant(bench).motor.supply = 6.0


def heat(bench: Bench, stop: StopRequest) -> None:
    """Heat the motor."""
    plant(bench).motor.temperature = 68.0


def load(bench: Bench, stop: StopRequest) -> None:
    """Hang four kilogrammes on the load cell."""
    bench.controls.hang_mass(4.0)  # pyright: ignore


def silence(bench: Bench, stop: StopRequest) -> None:
    """Let no answer of the servo come through."""
    bench.controls.set_faults(Faults(dropped_replies=1.0))  # pyright: ignore


def stall(bench: Bench, stop: StopRequest) -> None:
    """Let the computer be busy with something else for 75 ms."""
    bench.clock.sleep_until(bench.clock.now() + 0.075)


def terminate(bench: Bench, stop: StopRequest) -> None:
    """Send what a shutdown sends."""
    os.kill(os.getpid(), signal.SIGTERM)


def hang_up(bench: Bench, stop: StopRequest) -> None:
    """Send what a lost terminal sends."""
    os.kill(os.getpid(), signal.SIGHUP)


def interrupt(bench: Bench, stop: StopRequest) -> None:
    """Send what Ctrl-C sends."""
    os.kill(os.getpid(), signal.SIGINT)


def overload(bench: Bench, stop: StopRequest) -> None:
    """Hang forty kilogrammes on the load cell."""
    bench.controls.hang_mass(40.0)  # pyright: ignore


def surge(bench: Bench, stop: StopRequest) -> None:
    """Let the supply rise beyond what the servo takes."""
    plant(bench).motor.supply = 14.0


def jam(bench: Bench, stop: StopRequest) -> None:
    """Let the gear seize."""
    motor = plant(bench).motor
    motor._constants = replace(motor._constants, dry_friction=5.0)


def hush(bench: Bench, stop: StopRequest) -> None:
    """Take the noise from the load cell, all but a count or two."""
    for line in plant(bench).lines:
        cell = line.load_cell
        cell._constants = replace(cell._constants, noise=2e-5, wander=0.0, drift=0.0)


def worse(**chances: float) -> Callable[[Bench, StopRequest], None]:
    """Let answers and lines get lost, broken or late."""

    def happen(bench: Bench, stop: StopRequest) -> None:
        bench.controls.set_faults(Faults(**chances))  # pyright: ignore

    return happen


def lie(told: Callable[[float, float, int], float]) -> Callable[[Bench, StopRequest], None]:
    """Let each load cell tell something else, by the true tension [N], the time [s] and a count."""

    def happen(bench: Bench, stop: StopRequest) -> None:
        begin = bench.clock.now()
        for line in plant(bench).lines:
            cell, numbers = line.load_cell, count()
            c, honest = cell._constants, cell._disturbed

            def disturbed(counts: int, time: float, c=c, honest=honest, numbers=numbers) -> int:
                true = (honest(counts, time) - c.offset) / c.counts_per_newton
                said = told(true, time - begin, next(numbers))
                return max(-FULL - 1, min(FULL, round(c.offset + c.counts_per_newton * said)))

            cell._disturbed = disturbed

    return happen


def late(seconds: float) -> Callable[[Bench, StopRequest], None]:
    """Let each load cell tell the tension of some time ago."""

    def happen(bench: Bench, stop: StopRequest) -> None:
        for line in plant(bench).lines:
            past = deque([line.load_cell._felt] * round(1e3 * seconds))  # one each millisecond

            def take(pull: float, time: float, past=past, take=line.load_cell.take) -> bytes:
                past.append(pull)
                return take(past.popleft(), time)

            line.load_cell.take = take

    return happen


def pull_at(mass: float) -> Callable[[Bench, StopRequest], None]:
    """Hang a mass [kg] on each string, beyond its load cell: the motor feels it too."""

    def happen(bench: Bench, stop: StopRequest) -> None:
        for line in plant(bench).lines:
            advance, take = line.motor.advance, line.load_cell.take
            line.motor.advance = lambda pull, step, advance=advance: advance(
                pull + mass * GRAVITY, step
            )
            line.load_cell.take = lambda pull, time, take=take: take(pull + mass * GRAVITY, time)

    return happen


def exchange(bench: Bench, stop: StopRequest) -> None:
    """Let each of two load cells feel the other's string, as exchanged plugs do."""
    one, other = plant(bench).lines
    for cell, felt in ((one.load_cell, other.tendon), (other.load_cell, one.tendon)):
        cell.take = lambda _, time, take=cell.take, felt=felt: take(felt.spool_side, time)


def copy(bench: Bench, stop: StopRequest) -> None:
    """Let the second load cell tell the counts of the first, as from a port that is read twice."""
    first, second = (line.load_cell for line in plant(bench).lines)
    second._disturbed = lambda counts, time: first._last_counts


def misread(told: Callable[[float, float], float]) -> Callable[[Bench, StopRequest], None]:
    """Let each encoder tell another angle, by the true one [rad] and the time since then [s]."""

    def happen(bench: Bench, stop: StopRequest) -> None:
        begin = bench.clock.now()
        for line in plant(bench).lines:
            honest = line.encoder.read
            line.encoder.read = lambda angle, honest=honest: honest(
                told(angle, plant(bench).time - begin)
            )

    return happen


def lag(seconds: float) -> Callable[[Bench, StopRequest], None]:
    """Let each encoder tell where the spool was some time ago; none, where it was at first."""

    def happen(bench: Bench, stop: StopRequest) -> None:
        for line in plant(bench).lines:
            way = deque([line.motor.angle] * round(1e3 * seconds))  # it is read each millisecond
            honest = line.encoder.read

            def read(angle: float, way=way, honest=honest) -> None:
                way.append(angle)
                honest(way.popleft())

            line.encoder.read = read

    return happen


def pull(
    duty: float, *, off: bool = False, echo: bool = False
) -> Callable[[Bench, StopRequest], None]:
    """Let each motor have a duty of its own [1], whatever it is told, as long as it is on.

    Args:
        off: Whether it has that duty once it was switched off, in place of before.
        echo: Whether the servo says that it does what it is told, and takes no current.
    """

    def happen(bench: Bench, stop: StopRequest) -> None:
        for line, servo in zip(plant(bench).lines, bench.controls.servos, strict=True):  # pyright: ignore
            motor, tick, refresh = line.motor, line.firmware.tick, servo._refresh
            told = [motor.duty]

            def disobey(motor=motor, tick=tick, told=told) -> None:
                motor.duty = told[0]
                tick()
                told[0] = motor.duty
                if motor.enabled is not off:
                    motor.enabled, motor.duty = True, duty

            def repeat(*words: Any, motor=motor, refresh=refresh, told=told) -> None:
                true = motor.duty, motor.current
                motor.duty, motor.current = told[0], 0.0
                refresh(*words)
                motor.duty, motor.current = true

            line.firmware.tick = disobey
            if echo:
                servo._refresh = repeat  # pyright: ignore

    return happen


def both(*faults: Callable[[Bench, StopRequest], None]) -> Callable[[Bench, StopRequest], None]:
    """Let several things happen at once."""

    def happen(bench: Bench, stop: StopRequest) -> None:
        for fault in faults:
            fault(bench, stop)

    return happen


def stuck(counts: int | None = None) -> Callable[[Bench, StopRequest], None]:
    """Let the load cell repeat a value, its last one unless given [counts]."""
    return let("cell_stuck", duration=LONG, counts=counts)

"""Run a virtual bench: a servo and a load cell behind serial ports, with nothing plugged in.

Any program that speaks to a Dynamixel servo can use the ports: ``tendon-newton doctor --port
PORT``, ROBOTIS's own tools, yours. Verbs that take --port virtual start a bench of their own
and need none of this.
"""

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True, kw_only=True)
class VirtualBenchConfig:
    """Run a virtual bench until Ctrl-C."""

    bench: Literal["finger", "spring_weak", "spring_strong", "finger_antagonist"] = "finger"
    """Mechanism that the tendon pulls; the antagonistic finger has two tendons, with a servo
    each."""
    seed: int = 0  # Number of the unit: servos, tendons and fingers differ from unit to unit.
    obstacle: Literal["free", "tape_roll", "hand", "hand_perturbation"] = "free"
    """Obstacle in the mechanism's way."""
    load_cell_rate: Literal[80, 20, 10] = 80
    """Readings per second [Hz]; 20 is a mean of four at 80."""
    servo: Literal["sts3215", "sts3250", "xc330_t288_t", "xl330_m288_t"] = "xc330_t288_t"
    """Name of the servo."""
    worn: str = "new"
    """Wear of the unit: friction, its gear has run dry; spool, its spool has slipped; planted,
    three wrong things that its seed draws; or one alone by its effect, such as tendon_slack."""
    plant_file: Path | None = None  # Also write every constant of the unit here, as TOML.


def main(config: VirtualBenchConfig) -> None:
    """Start the bench, say how to reach it, and wait."""
    import signal
    from contextlib import suppress

    from tendon_hardware.virtual_bench import VirtualPorts

    for request in (signal.SIGINT, signal.SIGTERM):  # a shell may ignore them for us
        signal.signal(request, signal.default_int_handler)
    with (
        suppress(KeyboardInterrupt),
        VirtualPorts(
            config.bench,
            config.seed,
            obstacle=config.obstacle,
            load_cell_rate=config.load_cell_rate,
            servo=config.servo,
            wear=config.worn,
        ) as ports,
    ):
        if config.plant_file is not None:
            ports.plant_file(config.plant_file)
        print(f"virtual bench {config.bench}, unit {config.seed}, {config.servo}")
        for place, cell in enumerate(ports.load_cell_ports, start=1):
            print(f"  servo      {ports.servo_port}   ID {place}, 1000000 baud")
            print(f"  load cell  {cell}   115200 baud")
        print("\ntry, in another terminal:")
        words = ["--port", ports.servo_port, "--load-cell-port", ports.load_cell_port]
        print(f"  tendon-newton doctor {shlex.join(words)}")
        print("\nCtrl-C ends it", flush=True)
        signal.pause()
    print("\nended")

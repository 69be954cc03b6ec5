"""Examine a bench, what changed on it, or recorded data: what to do about each.

No motor moves. Without --port the serial ports that are there are listed. A dataset of ours is
looked at by all checks of an import. In a LeRobotDataset (v2, v3; a folder, or an id of Hugging
Face's Hub), or a folder of an arm's joints, each joint also gets its offset, delay, lag, play, time
in which it is held, missing and late rows, and passes or fails, alone and beside the others. A
recording says with --against what has changed since a diagnosis, before a run. The exit code is 0
where all is sound, 1 where something must be mended before data is worth taking, and 2 where what
was named cannot be used.

    tendon-newton doctor
    tendon-newton doctor --port /dev/ttyUSB0 --load-cell-port /dev/ttyACM0
    tendon-newton doctor --port virtual
    tendon-newton doctor --port /dev/ttyUSB0 --set-baud 1000000
    tendon-newton doctor --port /dev/ttyUSB0 --set-id 2
    tendon-newton doctor DATASET
    tendon-newton doctor lerobot/svla_so101_pickplace --json
    tendon-newton doctor DATASET --mend MENDED
    tendon-newton doctor --against found/diagnosis.json RECORDING
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tendon_newton.cli.bench.examined_data import Asked, examine_data
from tendon_newton.cli.terminal import VERDICT_COLOURS, coloured
from tendon_newton.errors import InvalidParameter

if TYPE_CHECKING:
    from tendon_hardware.doctor.observation import Observation

EXIT_FIX = 1  # Exit code where something must be mended.


@dataclass(frozen=True, kw_only=True)
class Doctor(Asked):
    """Bench or dataset to examine, and registers to change first."""

    against: Path | None = None
    """Diagnosis of the bench as it was: say which of its numbers moved, and what to do."""
    port: str | None = None  # Serial port of the servo's adapter, or virtual[:BENCH[:SEED]].
    load_cell_port: str | None = None
    """Serial port of the load cell; a virtual bench brings its own."""
    servo: str = "xc330_t288_t"  # Servo of a virtual bench; a real one says itself what it is.
    set_baud: int | None = None
    """Set the rate of the only servo on the port, which comes with 57600 from the factory."""
    set_id: int | None = None
    """Set the ID of the only servo on the port: 1 from the factory, and its own on a shared bus."""
    reboot: bool = False  # Restart the servos on the port first, which clears their alerts.


def main(config: Doctor) -> None:
    """Examine, print, and leave with code 1 where something must be mended."""
    if config.against is not None:
        hold_against(config, config.against)
        return
    if config.dataset:
        examine_datasets(config)
        return
    from tendon_hardware.doctor.examination import examine, ports_of
    from tendon_hardware.doctor.servo_search import reboot_servos, set_baud, set_identifier

    clock, port, cell_port = ports_of(config.port, config.load_cell_port, config.servo)
    changes = config.reboot or config.set_baud is not None or config.set_id is not None
    if port is None and changes:
        raise InvalidParameter("--port must name the servo's port to change it; it does not")
    if port is not None and config.reboot:
        show_observation(reboot_servos(port, clock, show))
    if port is not None and config.set_baud is not None:
        show_observation(set_baud(port, config.set_baud, clock, show))
    if port is not None and config.set_id is not None:
        show_observation(set_identifier(port, config.set_id, clock, show))
    count = 0
    for observation in examine(port, cell_port, clock=clock, show=show):
        show_observation(observation)
        count += observation.verdict == "fix"
    print(f"{count or 'nothing'} to mend")
    if count:
        raise SystemExit(EXIT_FIX)


def examine_datasets(config: Doctor) -> None:
    """Examine datasets, and leave with code 1 where one is not sound."""
    if config.port is not None:
        raise InvalidParameter("a dataset is examined alone; --port names a bench beside it")
    if config.mend is not None and len(config.dataset) > 1:
        raise InvalidParameter("--mend writes one dataset; name one")
    if not examine_data(config):
        raise SystemExit(EXIT_FIX)


def hold_against(config: Doctor, against: Path) -> None:
    """Say what a recording shows to have changed since a diagnosis."""
    if len(config.dataset) != 1 or config.port is not None:
        raise InvalidParameter(
            "--against needs a recording of the bench, and no --port: record one with `collect`"
        )
    from tendon_newton.device_code.quiet import quiet_warp

    quiet_warp()

    from tendon_newton.diagnosis.in_time.changes_report import answer_lines, steps_of
    from tendon_newton.workflows.comparing_days import compare_days

    days = compare_days(Path(config.dataset[0]), against, None, show)
    clear()
    print(*answer_lines(days), sep="\n")
    if any(map(steps_of, days.values())):
        raise SystemExit(EXIT_FIX)


def show_observation(observation: Observation) -> None:
    """Print one row, and the remedy below it."""
    clear()
    verdict = coloured(f"{observation.verdict:5}", VERDICT_COLOURS[observation.verdict])
    print(f"{verdict} {observation.subject:22} {observation.found}")
    if observation.remedy:
        print(f"      {'':22} -> {observation.remedy}")


def show(text: str) -> None:
    """Say what takes time, where somebody looks."""
    if sys.stdout.isatty():
        clear()
        print(f"      {text} ...", end="", flush=True)


def clear() -> None:
    """Wipe what was said to take time."""
    if sys.stdout.isatty():
        print("\r\033[K", end="")

"""Origin of a recording: the content of its metadata record."""

import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, is_dataclass
from datetime import UTC, datetime
from typing import Any, cast

from tendon_hardware.servos.base import ServoSettings
from tendon_newton.data.files.origin import git_commit


@dataclass(frozen=True, kw_only=True)
class Session:
    """All that decides a recording beside its signals; written at its front and at its end."""

    bench: str  # Name under ``assets/`` of the bench
    port: str  # Port and adapter of the servo
    run: str  # Name of the planned run
    excitation: str
    duration: float  # [s]
    split: str
    obstacle: str
    seed: int  # Seed of the excitation's draws
    rate: float  # Readings of the servo per second [Hz]
    command_rate: float  # Commands per second [Hz]
    # Gain [1/rad], limit and offset of the duty [1] of the loop on the host
    host_loop: Mapping[str, Any]
    servo: ServoSettings  # Settings that the servo read back
    # Identifier of the load cell's calibration; without one there are raw counts only
    calibration: str | None
    load_cell: str | None  # Kind of the load cell
    load_cell_rate: float | None  # Readings per second [Hz], measured at the start
    # What was done to a reading before it came: it shows later than the force
    load_cell_filter: str | None
    simulated: bool  # Whether a virtual bench stood in for the real one
    notes: str = ""  # Words of the operator to keep with the log
    # Where the position loop ran: on the host; older files may say ``position``, in the servo
    mode: str = "pwm"

    def text(self) -> dict[str, str]:
        """Return keys and values as a metadata record holds them, with the software's facts."""
        table = flattened({f.name: getattr(self, f.name) for f in fields(self)})
        return table | software(self.simulated)


def flattened(table: Mapping[str, Any], prefix: str = "") -> dict[str, str]:
    """Return nested values as dotted keys and words."""
    flat: dict[str, str] = {}
    for key, value in table.items():
        name = f"{prefix}{key}"
        if is_dataclass(value) and not isinstance(value, type):
            value = asdict(value)
        if isinstance(value, Mapping):
            flat |= flattened(cast(Mapping[str, Any], value), f"{name}.")
        else:
            flat[name] = "" if value is None else str(value)
    return flat


def software(simulated: bool) -> dict[str, str]:
    """Return versions, and date and machine where they mean something."""
    from tendon_newton import __version__

    facts = {"software": f"tendon-newton {__version__}", "git_commit": git_commit() or ""}
    if not simulated:  # a simulated run is the same on every day and machine
        facts["date"] = datetime.now(UTC).isoformat(timespec="seconds")
        facts["machine"] = (
            f"{platform.node()} {platform.machine()}, Python {platform.python_version()}"
        )
    return facts

"""Which topic and field of a ROS 2 recording holds which column."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path

from tendon_newton.errors import InvalidMapping, shown, unknown_name
from tendon_newton.frozen_mapping import frozen

STATE_TOPIC = "/servo/state"
COMMAND_TOPIC = "/servo/command"
DUTY_TOPIC = "/servo/duty"
FORCE_TOPIC = "/load_cell"
RAW_FORCE_TOPIC = "/load_cell/raw"
DIAGNOSTICS_TOPIC = "/servo/diagnostics"
TIP_TOPIC = "/tip"
BALL_TOPIC = "/ball"
TRUTH_TOPIC = "/bench/truth"
SESSION_RECORD = "session"  # Name of the metadata record that says how a recording was made

COLUMNS = (
    "theta_d",
    "theta",
    "theta_dot",
    "force",
    "tip_x",
    "tip_z",
    "current",
    "voltage",
    "temperature",
    "enabled",
)
MEASURED_COLUMNS = ("theta", "theta_dot")
CLOCKS = ("header", "log")

FIELD_STEP = re.compile(r"([A-Za-z_]\w*)|\[(\d+)\]|\[([A-Za-z_][\w ]*)\]")
"""One step into a message: a field, ``[2]`` for an entry, ``[voltage]`` for a key's value."""


def field_steps(path: str) -> tuple[str | int, ...]:
    """Split a path into a message into its steps; a key in brackets keeps them."""
    steps: list[str | int] = []
    for part in path.split("."):
        place = 0
        while match := FIELD_STEP.match(part, place):
            name, index, key = match.groups()
            steps.append(name or (int(index) if index is not None else f"[{key}]"))
            place = match.end()
        if place != len(part) or not part:
            raise InvalidMapping(
                "field must be a path like position, wrench.force.x, data[1] or "
                f"values[voltage]; it is {path!r}"
            )
    return tuple(steps)


@dataclass(frozen=True, kw_only=True)
class TopicSource:
    """Source of one column: a field of the messages on a topic."""

    topic: str  # Name of the topic
    # Path into the message: ``position``, ``wrench.force.x``, ``data[1]``, ``values[voltage]``
    field: str
    # Entries to take by name, one per tendon, of messages that name their joints; all if empty
    joints: tuple[str, ...] = ()
    scale: float = 1.0  # SI value per unit of the field
    offset: float = 0.0  # SI value where the field, scaled, is zero

    def __post_init__(self) -> None:
        field_steps(self.field)
        if not (isfinite(self.scale) and self.scale != 0.0 and isfinite(self.offset)):
            raise InvalidMapping(
                f"topic {self.topic!r}: scale must be finite and not 0, and offset finite; "
                f"they are {self.scale:g} and {self.offset:g}"
            )


@dataclass(frozen=True, kw_only=True)
class TopicMapping:
    """Sources of the columns of a recording."""

    sources: Mapping[str, TopicSource]  # Column -> source; a column without one is absent
    optional: frozenset[str] = frozenset()  # Columns whose topic may be missing from a file
    differentiate: bool = False  # Whether theta_dot is the central difference of theta
    # ``header``: times are the messages' own stamps; ``log``: when they were recorded
    clock: str = "header"
    path: Path | None = field(default=None)  # File that it was read from, for messages

    def __post_init__(self) -> None:
        where = f"{self.path}: " if self.path else ""
        for column in self.sources:
            if column not in COLUMNS:
                raise InvalidMapping(f"{where}{unknown_name('column', column, COLUMNS)}")
        present = {*self.sources, *(("theta_dot",) if self.differentiate else ())}
        missing = [column for column in MEASURED_COLUMNS if column not in present]
        if missing:
            raise InvalidMapping(
                f"{where}a mapping must say where {missing[0]!r} comes from; it maps "
                f"{', '.join(sorted(present)) or 'nothing'}"
            )
        if self.clock not in CLOCKS:
            raise InvalidMapping(
                f"{where}clock must be 'header' or 'log'; it is {shown(self.clock)}"
            )
        object.__setattr__(self, "sources", frozen(self.sources))


DEFAULT_MAPPING = TopicMapping(
    sources={
        "theta_d": TopicSource(topic=COMMAND_TOPIC, field="position"),
        "theta": TopicSource(topic=STATE_TOPIC, field="position"),
        "theta_dot": TopicSource(topic=STATE_TOPIC, field="velocity"),
        "current": TopicSource(topic=STATE_TOPIC, field="effort"),
        "force": TopicSource(topic=FORCE_TOPIC, field="wrench.force.x"),
        "voltage": TopicSource(topic=DIAGNOSTICS_TOPIC, field="status[0].values[voltage]"),
        "temperature": TopicSource(topic=DIAGNOSTICS_TOPIC, field="status[0].values[temperature]"),
        "tip_x": TopicSource(topic=TIP_TOPIC, field="point.x"),
        "tip_z": TopicSource(topic=TIP_TOPIC, field="point.z"),
    },
    optional=frozenset(set(COLUMNS) - set(MEASURED_COLUMNS)),
)
"""The topics of our own recordings."""

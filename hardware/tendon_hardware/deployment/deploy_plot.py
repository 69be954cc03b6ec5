"""What a log's picture shows: goal and tip, ball, spool, tension, timing, and whose they are."""

from collections.abc import Sequence
from math import degrees
from pathlib import Path

import numpy as np

from tendon_hardware.deployment.deploy_log import STEP_TOPIC, TIMING_FIELDS, TIMING_TOPIC
from tendon_hardware.deployment.svg_panels import Panel, PanelLine
from tendon_hardware.logs.session_log import TURNED_TOPIC
from tendon_newton.data.cards.policy_observation import goal_angle
from tendon_newton.data.formats.mcap_file import messages_of, read_session
from tendon_newton.data.formats.topic_mapping import STATE_TOPIC
from tendon_newton.data.recording import Array, Recording

GOAL, TIP = "goal", "tip"  # Names of the two lines whose distance is the error of a policy
ASKED, SEEN = "asked", "as seen"  # The same of a ball that turns
SIMULATED = "simulated"  # What a model makes of the commands
SHOWN: dict[str, tuple[tuple[str, str, float], ...]] = {
    "goal angle [deg]": (("alpha", GOAL, degrees(1.0)),),
    "turn of the ball [rad]": (("asked", ASKED, 1.0), ("turned", SEEN, 1.0)),
    "ball behind what was asked, as the policy sees it [rad]": (("behind", "behind", 1.0),),
    "ball from its start, as seen [mm]": tuple((f"ball_{axis}", axis, 1e3) for axis in "xyz"),
    "loop timing [ms]": (("lateness", "lateness", 1e3), ("duration", "tick's length", 1e3)),
}
"""Panels that a deployment's log alone has: which of its numbers, their names and units."""


def panels_of(
    log: Recording, path: Path, simulated: tuple[Array, Array] | None = None
) -> tuple[Panel, ...]:
    """Gather what a log shows: goal and tip, ball, spool, tension, timing.

    Args:
        log: Its rows.
        path: Its file, which says more if it is a log of ours.
        simulated: Spool angles [rad] and tensions [N] that a model makes of it, shape (T, D) each.
    """
    (goal, goals), *balls, (timing, late) = shown_lines(path).items()
    if log.tip is not None and not any(lines for _, lines in balls):
        tip = np.degrees(goal_angle(log.tip[:, 0], log.tip[:, 1]))
        goals.append(PanelLine(name=TIP, time=log.time, values=tip))
    servos = log.motor_position.shape[1]
    panels = [Panel(title=title, lines=tuple(lines)) for title, lines in ((goal, goals), *balls)]
    for d in range(servos):
        of = f" of servo {d}" if servos > 1 else ""
        spool = [PanelLine(name="measured", time=log.time, values=log.motor_position[:, d])]
        if log.command is not None:
            spool.insert(0, PanelLine(name="command", time=log.time, values=log.command[:, d]))
        if simulated is not None:
            spool.append(PanelLine(name=SIMULATED, time=log.time, values=simulated[0][:, d]))
        panels.append(Panel(title=f"spool angle{of} [rad]", lines=tuple(spool)))
    force = []
    if log.force is not None:
        force = [
            PanelLine(
                name=f"load cell {d}" if servos > 1 else "load cell", time=log.time, values=column
            )
            for d, column in enumerate(log.force.T)
        ]
    if simulated is not None:
        force += [
            PanelLine(
                name=f"{SIMULATED} {d}" if servos > 1 else SIMULATED, time=log.time, values=column
            )
            for d, column in enumerate(simulated[1].T)
        ]
    panels.append(Panel(title="tension [N]", lines=tuple(force)))
    panels.append(Panel(title=timing, lines=tuple(late)))
    return tuple(panel for panel in panels if panel.lines)


def is_log(path: Path) -> bool:
    """Tell whether a file is a log of ours, which says more than a recording does."""
    return path.suffix == ".mcap"


def shown_lines(path: Path) -> dict[str, list[PanelLine]]:
    """Return the lines of each panel of `SHOWN`; a log that is no deployment's has none."""
    if not is_log(path):
        return {title: [] for title in SHOWN}
    steps = read_session(path).get("policy.step_fields", "").split(", ")
    fields = {STEP_TOPIC: steps, TURNED_TOPIC: ("turned",), TIMING_TOPIC: TIMING_FIELDS}
    rows: dict[str, list[tuple[float, ...]]] = {topic: [] for topic in fields}
    first: int | None = None
    for topic, stamp, message in messages_of(path, STATE_TOPIC, *rows):
        first = stamp if first is None else first
        if topic in rows and np.size(message.data) == len(fields[topic]):
            rows[topic].append((1e-9 * (stamp - first), *np.atleast_1d(message.data)))
    known = {
        name: (time, values)
        for topic, names in fields.items()
        if rows[topic]
        for time, *columns in [np.array(rows[topic], dtype=np.float64).T]
        for name, values in zip(names, columns, strict=True)
    }
    if "rate" in known:
        time, rate = known["rate"]
        known["asked"] = time, np.cumsum(rate * np.diff(time, prepend=time[0]))
    return {
        title: [
            PanelLine(name=name, time=time, values=unit * values, band=title == "loop timing [ms]")
            for field, name, unit in lines
            if field in known
            for time, values in [known[field]]
        ]
        for title, lines in SHOWN.items()
    }


def title_of(path: Path, panels: Sequence[Panel]) -> str:
    """Return the file's name, who drove which bench when, and what came of it."""
    session = read_session(path) if is_log(path) else {}
    policy = session.get("policy.file", "")
    bench, simulated = session.get("bench", ""), session.get("simulated") == "True"
    words = [
        f"policy {Path(policy).stem}" if policy else "",
        f"on {'the virtual bench' if simulated else 'the bench'} {bench}" if bench else "",
        session.get("date", "")[:10],
    ]
    return f"{path.name}: {' '.join(filter(None, words)) or 'a recording'}{outcome(panels)}"


def outcome(panels: Sequence[Panel]) -> str:
    """Say how far a ball has turned, or a tip was from its goal, where a log has both lines."""
    lines = {line.name: line for panel in panels for line in panel.lines}
    if ASKED in lines and SEEN in lines:
        turned, asked = (lines[name].values[-1] for name in (SEEN, ASKED))
        return f"; turned {turned:.1f} rad, asked for {asked:.1f}"
    if GOAL not in lines or TIP not in lines:
        return ""
    goal, tip = lines[GOAL], lines[TIP]
    inside = (tip.time >= goal.time[0]) & (tip.time <= goal.time[-1])
    held = np.searchsorted(goal.time, tip.time[inside], side="right") - 1
    error = np.sqrt(np.nanmean(np.square(tip.values[inside] - goal.values[held])))
    return f"; tip {error:.1f} deg RMS from its goal"

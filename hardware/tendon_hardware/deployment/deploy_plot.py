"""What a log's picture shows: goal and tip, spool, tension, timing, and a title that says whose."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tendon_hardware.deployment.deploy_log import (
    STEP_TOPIC,
    TIMING_FIELDS,
    TIMING_TOPIC,
    servo_count_of,
)
from tendon_hardware.deployment.svg_panels import Panel, PanelLine, Values
from tendon_newton.data.cards.policy_observation import goal_angle
from tendon_newton.data.formats.mcap_file import McapReading, read_mcap, read_session
from tendon_newton.data.formats.topic_mapping import STATE_TOPIC

GOAL, TIP = "goal", "tip"  # Names of the two lines whose distance is the error of a policy
AXES = ("x", "y", "z")  # Names of a ball's coordinates


def panels_of(path: Path) -> tuple[Panel, ...]:
    """Gather what a log shows: goal and tip, spool, tension, timing."""
    log = read_mcap(path, bench="finger")
    goals, balls, late = logged_lines(path)
    if log.tip is not None:
        tip = np.degrees(goal_angle(log.tip[:, 0], log.tip[:, 1]))
        goals.append(PanelLine(name=TIP, time=log.time, values=tip))
    servos = log.motor_position.shape[1]
    panels = [
        Panel(title="goal angle [deg]", lines=() if balls else tuple(goals)),
        Panel(title="ball from its start, as seen [mm]", lines=tuple(balls)),
    ]
    for d in range(servos):
        of = f" of servo {d}" if servos > 1 else ""
        spool = [PanelLine(name="measured", time=log.time, values=log.motor_position[:, d])]
        if log.command is not None:
            spool.insert(0, PanelLine(name="command", time=log.time, values=log.command[:, d]))
        panels.append(Panel(title=f"spool angle{of} [rad]", lines=tuple(spool)))
    force = []
    if log.force is not None:
        force = [
            PanelLine(
                name=f"load cell {d}" if servos > 1 else "load cell", time=log.time, values=column
            )
            for d, column in enumerate(log.force.T)
        ]
    panels.append(Panel(title="tension [N]", lines=tuple(force)))
    panels.append(Panel(title="loop timing [ms]", lines=tuple(late)))
    return tuple(panel for panel in panels if panel.lines)


def logged_lines(path: Path) -> tuple[list[PanelLine], list[PanelLine], list[PanelLine]]:
    """Return goals, a ball's places and timing of a deployment; any other log has none."""
    first: int | None = None
    goals: list[tuple[float, float]] = []
    balls: list[tuple[float, ...]] = []
    timing: list[tuple[float, float, float]] = []
    with path.open("rb") as file:
        wanted = {STATE_TOPIC, STEP_TOPIC, TIMING_TOPIC}
        for topic, stamp, message in McapReading(file, path.name).messages(wanted):
            first = stamp if first is None else first
            seconds = 1e-9 * (stamp - first)
            if topic == STEP_TOPIC and (place := goal_place(len(message.data))) is not None:
                goals.append((seconds, np.degrees(message.data[place])))
                seen = message.data[place + 1 : len(message.data) - 3 * (place // 4) - 1]
                if len(seen) > len(AXES):
                    balls.append((seconds, *(1e3 * value for value in seen[-len(AXES) :])))
            elif topic == TIMING_TOPIC and len(message.data) == len(TIMING_FIELDS):
                timing.append((seconds, 1e3 * message.data[1], 1e3 * message.data[2]))
    time, alpha = columns(goals, 2)
    instants, lateness, length = columns(timing, 3)
    sighted, *places = columns(balls, 1 + len(AXES))
    return (
        [PanelLine(name=GOAL, time=time, values=alpha)] if goals else [],
        [
            PanelLine(name=axis, time=sighted, values=way)
            for axis, way in zip(AXES, places, strict=True)
        ]
        if balls
        else [],
        [
            PanelLine(name="lateness", time=instants, values=lateness, band=True),
            PanelLine(name="tick's length", time=instants, values=length, band=True),
        ]
        if timing
        else [],
    )


def goal_place(width: int) -> int | None:
    """Return where the goal stands among the numbers of a step; none if it is no step of ours."""
    servos = servo_count_of(width)
    return None if servos is None else 4 * servos


def columns(rows: Sequence[tuple[float, ...]], width: int) -> Values:
    """Return rows as columns."""
    return np.array(rows, dtype=np.float64).reshape(-1, width).T


def title_of(path: Path, panels: Sequence[Panel]) -> str:
    """Return the file's name, who drove which bench when, and how far the tip was from its goal."""
    session = read_session(path)
    policy = session.get("policy.file", "")
    bench, simulated = session.get("bench", ""), session.get("simulated") == "True"
    words = [
        f"policy {Path(policy).stem}" if policy else "",
        f"on {'the virtual bench' if simulated else 'the bench'} {bench}" if bench else "",
        session.get("date", "")[:10],
    ]
    error = tip_error(panels)
    tail = "" if error is None else f"; tip {error:.1f} deg RMS from its goal"
    return f"{path.name}: {' '.join(filter(None, words)) or 'a recording'}{tail}"


def tip_error(panels: Sequence[Panel]) -> float | None:
    """Return the RMS distance of the tip's angle from its goal [deg], where a log has both."""
    lines = {line.name: line for panel in panels for line in panel.lines}
    if GOAL not in lines or TIP not in lines:
        return None
    goal, tip = lines[GOAL], lines[TIP]
    inside = (tip.time >= goal.time[0]) & (tip.time <= goal.time[-1])
    held = np.searchsorted(goal.time, tip.time[inside], side="right") - 1
    return float(np.sqrt(np.nanmean(np.square(tip.values[inside] - goal.values[held]))))

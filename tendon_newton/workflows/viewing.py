"""Logs in rerun, and simulations beside what was measured."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tendon_hardware.deployment.deploy_log import STEP_TOPIC, servo_count_of
from tendon_newton.data.dataset import listed_files, load_recording
from tendon_newton.data.formats.mcap_file import McapReading
from tendon_newton.data.formats.topic_mapping import (
    COMMAND_TOPIC,
    DIAGNOSTICS_TOPIC,
    FORCE_TOPIC,
    SESSION_RECORD,
    STATE_TOPIC,
    TIP_TOPIC,
)
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.diagnosed_bench import open_model
from tendon_newton.errors import InvalidParameter, listed
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.replay import replay
from tendon_newton.simulation.hosts.rollout import Trajectory
from tendon_newton.workflows.scene import BenchScene, View

TOPICS = frozenset(
    {COMMAND_TOPIC, STATE_TOPIC, FORCE_TOPIC, TIP_TOPIC, DIAGNOSTICS_TOPIC, STEP_TOPIC}
)
SUFFIXES = (".mcap", ".csv")  # Files that are shown
SAFETY = "safety"  # Source of what the rules did
LEVELS = ("info", "warn", "error", "error")  # Names of the levels of a diagnostic status


def show_log(path: Path, to: View) -> BenchScene:
    """Show a log as far as it goes: an MCAP file of ``collect`` or ``deploy``, or a CSV."""
    if path.suffix not in SUFFIXES:
        raise InvalidParameter(f"{path}: a view shows logs and recordings, {listed(SUFFIXES)}")
    if path.suffix == ".csv":
        return show_recording(load_recording(path), to, path)
    with path.open("rb") as file:
        session = first_session(file, path.name)
        bench, goals = session.get("bench", "finger"), "policy.file" in session
        scene = BenchScene(path.stem, bench, to, path, goals=goals)
        first: int | None = None
        for topic, stamp, message in McapReading(file, path.name).messages(TOPICS):
            first = stamp if first is None else first
            scene.at(1e-9 * (stamp - first))
            show_message(scene, topic, message)
        scene.close()
    return scene


def first_session(file: Any, name: str) -> dict[str, str]:
    """Return what a log says at its beginning of how it is made."""
    for record in McapReading(file, name).records():
        if type(record).__name__ == "Metadata" and record.name == SESSION_RECORD:
            return dict(record.metadata)
        if type(record).__name__ == "Message":
            break
    return {}


def show_message(scene: BenchScene, topic: str, message: Any) -> None:
    """Show one message."""
    if topic in (STATE_TOPIC, COMMAND_TOPIC):
        who = "measured" if topic == STATE_TOPIC else "command"
        for tendon, angle in enumerate(message.position):
            scene.angle(who, float(angle), tendon)
    elif topic == FORCE_TOPIC:
        tendon = message.header.frame_id.rpartition("_")[2]
        place = int(tendon) if tendon.isdecimal() else 0
        scene.tension("measured", float(message.wrench.force.x), place)
    elif topic == TIP_TOPIC:
        scene.point("tip", float(message.point.x), float(message.point.z))
    elif topic == STEP_TOPIC:
        if (servos := servo_count_of(len(message.data))) is not None:
            scene.goal(float(message.data[4 * servos]))
    else:
        for status in message.status:
            number = status.level[0] if isinstance(status.level, bytes) else int(status.level)
            told = number > 0 or status.name == SAFETY  # a servo that is well says so all the time
            if told and number < len(LEVELS):
                scene.say(f"{status.name}: {status.message}", LEVELS[number])


def show_model(path: Path, model: Path, to: View) -> BenchScene:
    """Show a log or a recording beside what a model, as `open_model` reads it, makes of it."""
    recording = load_recording(path)
    own = open_model(model, [load_mechanism(recording.bench)])
    (trajectory,) = replay([recording], own)
    return show_recording(recording, to, path, trajectory)


def show_recording(
    recording: Recording, to: View, file: Path, trajectory: Trajectory | None = None
) -> BenchScene:
    """Show what was measured, and what a model made of it.

    Args:
        trajectory: What was simulated, at the same rows.
    """
    scene = BenchScene(Path(recording.name).stem, recording.bench, to, file)
    for row, instant in enumerate(recording.time - recording.time[0]):
        scene.at(float(instant))
        if trajectory is not None:
            scene.bones("simulated", trajectory.joint_position[row])
        for d in range(recording.tendon_count):
            if recording.command is not None:
                scene.angle("command", float(recording.command[row, d]), d)
            scene.angle("measured", float(recording.motor_position[row, d]), d)
            if recording.force is not None:
                scene.tension("measured", float(recording.force[row, d]), d)
            if trajectory is not None:
                scene.angle("simulated", float(trajectory.motor_position[row, d]), d)
                scene.tension("simulated", float(trajectory.force[row, d]), d)
        if recording.tip is not None:
            scene.point("tip", *(float(x) for x in recording.tip[row]))
    scene.close()
    return scene


def logs_of(paths: Sequence[Path]) -> list[Path]:
    """Return the logs that paths name: files, and those in folders."""
    out: list[Path] = []
    for path in paths:
        found = [path]
        if path.is_dir():
            known = listed_files(path)
            recordings = [file for file in path.glob("*.csv") if not known or file.name in known]
            found = sorted([*path.glob("*.mcap"), *recordings])
        if not found or not found[0].is_file():
            raise InvalidParameter(f"{path}: no log ({listed(SUFFIXES)}) is there")
        out += found
    return out

"""A whole arm carried into another program, and how far it strays there from our own simulation."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np

from tendon_newton.actuators.ideal_position import IdealPosition
from tendon_newton.arms.arm import Arm, ArmMotion, motions_of
from tendon_newton.arms.arm_file import IdentifiedArm, without
from tendon_newton.arms.arm_simulation import simulate_arm
from tendon_newton.data.dataset import dataset_folders, load_dataset
from tendon_newton.data.excitations import RATE
from tendon_newton.data.recording import Array, Recording
from tendon_newton.errors import InvalidParameter, InvalidRecording, listed
from tendon_newton.exports.arms import ARM_EXPORTS
from tendon_newton.exports.arms.arm_target import ArmTarget, ArmWay
from tendon_newton.exports.arms.mujoco_arm import SWING, middle_of
from tendon_newton.exports.departure import Departure, pooled
from tendon_newton.exports.export_page import Fidelity, told_lines, write_page
from tendon_newton.exports.export_target import Exported
from tendon_newton.exports.model_numbers import nearly, not_exact, refuse_damaged
from tendon_newton.exports.source import Source
from tendon_newton.identification.cutting import first_part
from tendon_newton.mechanisms.geometry.kinematics import posture
from tendon_newton.mechanisms.geometry.parts import Tip

FLOOR = "floor"  # What the tip rests on, where a page says what is left out
# Of the first joint's swing and the last one's, where no motion was recorded [rad/s]
STANDARD_RATES = (0.9, 2.3)
STANDARD_SECONDS = 8.0


def arm_motions(arm: Arm, dataset: Path | None, seconds: float = inf) -> tuple[ArmMotion, ...]:
    """Return the motions that are replayed: test recordings of a folder of joints, or swings.

    Each joint has a dataset in the folder, of which so many seconds are taken; one without stands
    at 0.

    Raises:
        InvalidRecording: The folder has no dataset of a joint, or one of another.
    """
    if dataset is None:
        return (swings(arm),)
    if not (folders := dataset_folders(dataset)):
        raise InvalidRecording(
            f"{dataset}: an arm has a folder with a dataset of each joint; this one has none in it"
        )
    recordings = {
        folder.name: first_part(load_dataset(folder, require_train=False).test, seconds)
        for folder in folders
    }
    return motions_of(recordings, arm.mechanism.joint_names)


def servo_as_arm(source: Source) -> tuple[IdentifiedArm, tuple[ArmMotion, ...]] | None:
    """Return a servo that only moves its shaft as an arm of one joint, and its commands.

    None where a model has a force, or a bench more than that shaft.
    """
    mechanism, model = source.mechanism, source.model
    shaft = len(mechanism.joints) == 1 and all(tendon.direct for tendon in mechanism.tendons)
    if model.actuator.name != IdealPosition.name or not shaft:
        return None
    arm = Arm(
        mechanism=mechanism, sign=np.ones(1), zero=np.zeros(1), gravity=mechanism.gravity
    )  # fmt: skip
    motions = tuple(ArmMotion(recordings=(run,)) for run in source.runs)
    return IdentifiedArm(arm=arm, models=(model,)), motions


def swings(arm: Arm) -> ArmMotion:
    """Return commands that swing each joint about the middle of its range."""
    time = np.arange(round(STANDARD_SECONDS * RATE)) / RATE
    rates = np.linspace(*STANDARD_RATES, len(arm.sign))
    command = middle_of(arm) + SWING * np.sin(np.outer(time, rates))
    return ArmMotion(
        recordings=tuple(
            Recording(
                name="standard",
                bench="servo",
                time=time,
                command=own[:, None],
                motor_position=own[:, None],
                motor_velocity=np.zeros((len(time), 1)),
            )
            for own in command.T
        )
    )


def export_arm(
    out: Path,
    arm: IdentifiedArm,
    to: str,
    motions: Sequence[ArmMotion],
    progress: Callable[[float], None],
) -> tuple[Exported, list[str]]:
    """Write an arm for a program, with a page that says how far it strays; return its lines.

    `progress` is told of each replay how long it was [s].

    Raises:
        InvalidParameter: Whole arms do not go to that program.
        InvalidModelFile: A number of a servo is missing or out of range.
        InvalidOutput: A file cannot be written.
    """
    target = target_of(to)
    for model in arm.models:
        refuse_damaged(model)
    left_out, in_another_form = (
        {
            name: tuple(sorted({e for m in arm.models for e in which(m, way.coverage)}))
            for name, way in target.ways.items()
        }
        for which in (not_exact, nearly)
    )
    if arm.arm.floor is not None:
        left_out |= {n: (*left_out[n], FLOOR) for n, way in target.ways.items() if not way.floor}
    exported = Exported(
        files=target.write(out, arm), loading=target.loading(arm), left_out=left_out,
        nearly=in_another_form,
    )  # fmt: skip
    ours = simulated(arm, motions)

    def replayed(way: ArmWay) -> Iterator[Array]:
        for motion in motions:
            yield way.replay(out, arm, motion)
            progress(seconds_of([motion]))

    worth = {
        effect: strayed(arm.arm, simulated(lacking(arm, effect), motions), ours)
        for effect in sorted({name for names in left_out.values() for name in names})
    }
    fidelity = Fidelity(
        runs=tuple(motion.recordings[0].name for motion in motions),
        replays={
            name: strayed(arm.arm, list(replayed(way)), ours) for name, way in target.ways.items()
        },
        costs={way: {e: worth[e] for e in names} for way, names in left_out.items() if names},
    )
    write_page(out, f"{arm.arm.mechanism.name}, for {to}", exported, fidelity)
    return exported, told_lines(fidelity, exported)


def target_of(to: str) -> ArmTarget:
    """Return the target of a whole arm.

    Raises:
        InvalidParameter: Whole arms do not go there.
    """
    if to not in ARM_EXPORTS:
        raise InvalidParameter(
            f"--to of a whole arm must be {listed(ARM_EXPORTS)}; it is {to!r}: a servo alone goes "
            "there from the folder of its joint"
        )
    return ARM_EXPORTS[to]


def seconds_of(motions: Sequence[ArmMotion]) -> float:
    """Return how long motions are together [s]."""
    return sum(float(motion.time[-1] - motion.time[0]) for motion in motions)


def lacking(arm: IdentifiedArm, what: str) -> IdentifiedArm:
    """Return an arm without its floor, or whose servos lack an effect."""
    if what == FLOOR:
        return replace(arm, arm=replace(arm.arm, floor=None))
    return without(arm, what)


def simulated(arm: IdentifiedArm, motions: Sequence[ArmMotion]) -> list[Array]:
    """Return where our own simulation takes the servos [rad], (T, J) by motion."""
    return [state.angles for state in simulate_arm(arm.arm, dict(enumerate(arm.models)), motions)]


def strayed(arm: Arm, one: Sequence[Array], other: Sequence[Array]) -> Departure:
    """Return how far angles of the same motions lie apart, (T, J) each [rad]."""
    pairs, tip = list(zip(one, other, strict=True)), arm.mechanism.tip
    return Departure(
        angle=pooled([a - b for a, b in pairs]),
        force=None,
        tip=tip and pooled([tips(arm, tip, a) - tips(arm, tip, b) for a, b in pairs]),
    )


def tips(arm: Arm, tip: Tip, angles: Array) -> Array:
    """Return where the tip is [m], shape (T, 3)."""
    frames = posture(arm.mechanism, arm.sign * angles + arm.zero)
    return frames.place(tip.body, tip.point)

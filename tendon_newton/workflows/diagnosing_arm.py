"""Diagnose all servos of an arm in one go, each under the loads of the arm."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from tendon_newton.arms.arm import ArmMotion, motions_of
from tendon_newton.arms.arm_file import ARM_FILE
from tendon_newton.arms.arm_simulation import SETTLED, simulate_arm
from tendon_newton.arms.known_arm import KnownArm, each_servo, know_arm
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.files.text_file import make_folder
from tendon_newton.data.model_file import Model
from tendon_newton.diagnosis.reporting.report import Origin
from tendon_newton.errors import InvalidRecording
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.workflows.diagnosing import DiagnosisAnswer, diagnose_into


@dataclass(frozen=True, kw_only=True)
class ArmAnswer:
    """A diagnosis of each servo of an arm."""

    servos: Mapping[str, DiagnosisAnswer]
    """Joint -> its diagnosis."""
    known: KnownArm | None = None
    """The arm; None where none was given."""
    plain: Mapping[str, float] = field(default_factory=dict[str, float])
    """Joint -> RMS error on test recordings of plain servos simulated together [rad]."""
    together: Mapping[str, float] = field(default_factory=dict[str, float])
    """Joint -> RMS error on test recordings of the diagnosed servos simulated together [rad]."""


def diagnose_arm_into(
    out: Path,
    datasets: Mapping[str, Dataset],
    models: Mapping[str, Model],
    mechanism: Mechanism | None,
    command: str,
    *,
    progress: Callable[[str], None],
    until: float | None = None,
) -> ArmAnswer:
    """Diagnose each servo into a folder of its own; with an arm write ``arm.json`` last.

    Args:
        out: Folder of the results; made if it is not there.
        datasets: Joint -> its recordings.
        models: Joint -> the model to start from.
        mechanism: The arm; without it each servo is diagnosed alone.
        command: What was typed, for the reports.
        progress: Told what is being done.
        until: Instant of the monotonic clock at which the searches are to be over, about [s].

    Raises:
        InvalidRecording: The datasets are not those of the arm's joints.
    """
    make_folder(out)
    if mechanism is None:
        return ArmAnswer(servos=diagnose_each(out, datasets, models, command, progress, until))
    datasets = in_order(datasets, mechanism)
    progress("looking how the arm stands, and what its tip rests on")
    seen = motions_of({joint: data.train for joint, data in datasets.items()})
    unseen = motions_of({joint: data.test for joint, data in datasets.items()})
    known = know_arm(mechanism, seen, [models[joint] for joint in datasets])
    weights = [known.arm.weight(motion.angles) for motion in unseen]
    loaded = zip(datasets, known.with_loads(seen), each_servo(unseen, weights), strict=True)
    datasets = {j: replace(datasets[j], train=train, test=test) for j, train, test in loaded}
    models = dict(zip(datasets, known.starts, strict=True))
    servos = diagnose_each(out, datasets, models, command, progress, until)
    progress("simulating all servos together on the test recordings")
    found = [one.diagnosis.model for one in servos.values()]
    errors = [errors_together(known, each, unseen, progress) for each in (known.plain, found)]
    plain, together = (dict(zip(servos, rms, strict=True)) for rms in errors)
    answer = ArmAnswer(servos=servos, known=known, plain=plain, together=together)
    write_json(out / ARM_FILE, arm_table(answer, known))
    return answer


def errors_together(
    known: KnownArm,
    models: Sequence[Model],
    motions: Sequence[ArmMotion],
    progress: Callable[[str], None],
) -> list[float]:
    """Return each servo's RMS error [rad] where all are simulated together, by commands alone."""
    states = simulate_arm(known.arm, dict(enumerate(models)), motions)
    if (deep := max(state.depth for state in states)) > SETTLED:
        progress(f"the tip does not settle on what it rests on: {1e3 * deep:.1f} mm are left.")
    missed = np.concatenate([s.angles - m.angles for s, m in zip(states, motions, strict=True)])
    return np.sqrt(np.mean(missed**2, axis=0)).tolist()


def diagnose_each(
    out: Path,
    datasets: Mapping[str, Dataset],
    models: Mapping[str, Model],
    command: str,
    progress: Callable[[str], None],
    until: float | None,
) -> dict[str, DiagnosisAnswer]:
    """Diagnose one servo after the other; each has an equal part of the time that is left."""
    answers: dict[str, DiagnosisAnswer] = {}
    for joint, dataset in datasets.items():
        progress(f"{joint}.")
        waiting = len(datasets) - len(answers)
        part = None if until is None else max(0.0, until - time.monotonic()) / waiting
        origin = Origin(dataset=dataset.path, command=command)
        answers[joint] = diagnose_into(
            out / joint, dataset, models[joint], origin, progress=progress, budget=part
        )
    return answers


def in_order(datasets: Mapping[str, Dataset], mechanism: Mechanism) -> dict[str, Dataset]:
    """Return the datasets in the order of an arm's joints.

    Raises:
        InvalidRecording: They are not those of the joints.
    """
    names = mechanism.joint_names
    if set(names) != set(datasets):
        raise InvalidRecording(
            f"an arm has a dataset in a folder of the name of each joint; {mechanism.name!r} has "
            f"{', '.join(names)}, there are folders {', '.join(datasets)}: rename them"
        )
    return {name: datasets[name] for name in names}


def arm_table(answer: ArmAnswer, known: KnownArm) -> dict[str, object]:
    """Make the table of ``arm.json``; angles in rad, the floor's height in m."""
    place = known.placement
    joints = zip(answer.servos, place.arm.sign, place.sign_told, place.arm.zero, place.zero_sd,
                 strict=True)  # fmt: skip
    return {
        "schema": 1,
        "asset": str(place.arm.mechanism.asset),
        "joints": {
            joint: {
                "sign": int(sign),
                "sign_told": bool(told),
                "zero": float(zero),
                "zero_sd": float(sd),
                "plain_rmse": answer.plain[joint],
                "together_rmse": answer.together[joint],
            }
            for joint, sign, told, zero, sd in joints
        },
        "tilt": place.tilt.tolist(),
        "tilt_sd": place.tilt_sd.tolist(),
        "floor": known.arm.floor,
    }

"""Diagnose all servos of an arm in one go, each under the loads of the arm, and tell the answer."""

import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tendon_newton.arms.arm import ArmMotion, motions_of
from tendon_newton.arms.arm_file import ARM_FILE, STANDING
from tendon_newton.arms.arm_simulation import SETTLED, simulate_arm
from tendon_newton.arms.known_arm import KnownArm, each_servo, know_arm
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.files.output_folder import make_folder
from tendon_newton.data.model_file import Model
from tendon_newton.data.plain_numbers import quantity
from tendon_newton.diagnosis.diagnose import numbers_of
from tendon_newton.diagnosis.report_words import cause_text
from tendon_newton.diagnosis.reporting.report import Origin
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.diagnosis.time_left import time_text
from tendon_newton.mechanisms.authoring.foreign_file import SUFFIXES, read_foreign, word
from tendon_newton.mechanisms.authoring.foreign_plan import plan_foreign, write_foreign
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.workflows.diagnosing import diagnose_into

BETTER = 0.1
"""Share of a plain servo's squared error that causes take away, to be worth their names. Chosen."""
ASSET = "asset"  # Folder beside the results with an arm that was described by another file


@dataclass(frozen=True, kw_only=True)
class ArmAnswer:
    """A diagnosis of each servo of an arm."""

    servos: Mapping[str, Diagnosis]  # Joint -> its diagnosis, in the arm's order
    known: KnownArm | None = None  # The arm; None where none was given
    # Joint -> the model that was written, which is the plain one where nothing was named
    models: Mapping[str, Model] = field(default_factory=dict[str, Model])
    # Joint -> RMS error on test recordings of plain servos simulated together [rad]
    plain: Mapping[str, float] = field(default_factory=dict[str, float])
    # Joint -> RMS error on test recordings of the diagnosed servos simulated together [rad]
    together: Mapping[str, float] = field(default_factory=dict[str, float])


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
        datasets: Joint -> its recordings; a joint of the arm that has none stands at 0.
        models: Joint -> the model to start from.
        mechanism: The arm; without it each servo is diagnosed alone.
        until: Instant of the monotonic clock at which the searches are to be over, about [s].

    Raises:
        InvalidRecording: The datasets are not those of the arm's joints.
    """
    make_folder(out)
    if mechanism is None:
        return ArmAnswer(servos=diagnose_each(out, datasets, models, command, progress, until))
    joints = mechanism.joint_names
    seen = motions_of({joint: data.train for joint, data in datasets.items()}, joints)
    unseen = motions_of({joint: data.test for joint, data in datasets.items()}, joints)
    for joint in joints:
        if joint not in datasets:
            progress(f"{joint} has no dataset: it is taken to stand at 0.")
    progress("looking how the arm stands, and what its tip rests on")
    known = know_arm(mechanism, seen, [models.get(joint, STANDING) for joint in joints])
    weights = [known.arm.weight(motion.angles) for motion in unseen]
    loaded = zip(joints, known.with_loads(seen), each_servo(unseen, weights), strict=True)
    datasets = {
        joint: replace(datasets[joint], train=train, test=test)
        for joint, train, test in loaded
        if joint in datasets
    }
    models = dict(zip(joints, known.starts, strict=True))
    found = list(known.plain)

    def finish(joint: str, diagnosis: Diagnosis) -> Model:
        place = joints.index(joint)
        found[place] = known.servo(place, diagnosis)
        return found[place]

    servos = diagnose_each(out, datasets, models, command, progress, until, finish)
    progress("simulating all servos together on the test recordings")
    errors = [errors_together(known, each, unseen, progress) for each in (known.plain, found)]
    plain, together = (dict(zip(joints, rms, strict=True)) for rms in errors)
    written = dict(zip(joints, found, strict=True))
    answer = ArmAnswer(servos=servos, known=known, models=written, plain=plain, together=together)
    write_json(out / ARM_FILE, arm_table(answer, known))
    return answer


def arm_mechanism(asset: str, out: Path) -> Mechanism:
    """Return the arm of an asset, by name or file; of a URDF or an MJCF an asset is made.

    Args:
        out: Folder of the results, in which that asset gets a folder.

    Raises:
        InvalidAsset: The file is broken, or is no arm's.
    """
    source = Path(asset)
    if source.suffix not in SUFFIXES:
        return load_mechanism(asset)
    plan = plan_foreign(word(source.stem), read_foreign(source))
    with TemporaryDirectory() as draft:
        file = write_foreign(Path(draft), plan)
        home = out / ASSET / file.parent.name
        shutil.copytree(file.parent, home, dirs_exist_ok=True)
    return load_mechanism(home / file.name)


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
    finish: Callable[[str, Diagnosis], Model] = lambda joint, diagnosis: diagnosis.model,
) -> dict[str, Diagnosis]:
    """Diagnose one servo after the other; each has an equal part of the time that is left.

    Args:
        finish: Gives the model of a joint that is written.
    """
    answers: dict[str, Diagnosis] = {}
    start, count = time.monotonic(), len(datasets)
    for joint, dataset in datasets.items():
        waiting = count - len(answers)
        each = (time.monotonic() - start) / max(len(answers), 1)
        left = f", {time_text(waiting * each)} left for all of them" if answers else ""
        progress(f"{joint}, {len(answers) + 1} of {count} joints{left}.")
        part = None if until is None else max(0.0, until - time.monotonic()) / waiting
        origin = Origin(dataset=dataset.path, command=command)
        answers[joint] = diagnose_into(
            out / joint,
            dataset,
            models[joint],
            origin,
            progress=progress,
            budget=part,
            finish=partial(finish, joint),
        )
    return answers


def arm_table(answer: ArmAnswer, known: KnownArm) -> dict[str, object]:
    """Make the table of ``arm.json``; angles in rad, the floor's height in m."""
    place = known.placement
    joints = zip(place.arm.mechanism.joint_names, place.arm.sign, place.sign_told, place.arm.zero,
                 place.zero_sd, strict=True)  # fmt: skip
    return {
        "schema": 1,
        "asset": str(place.arm.mechanism.asset),
        "joints": {
            joint: {
                "sign": int(sign),
                "sign_told": bool(told),
                "zero": float(zero),
                "zero_sd": float(sd),
                "diagnosed": joint in answer.servos,
                "plain_rmse": answer.plain[joint],
                "together_rmse": answer.together[joint],
            }
            for joint, sign, told, zero, sd in joints
        },
        "tilt": place.tilt.tolist(),
        "tilt_sd": place.tilt_sd.tolist(),
        "floor": known.arm.floor,
    }


def arm_lines(known: KnownArm) -> list[str]:
    """Say how an arm stands."""
    place = known.placement
    joints = known.arm.mechanism.joint_names
    turned = [joint for joint, sign in zip(joints, place.arm.sign, strict=True) if sign < 0.0]
    silent = [joint for joint, told in zip(joints, place.sign_told, strict=True) if not told]
    lines = [f"servos that count the other way: {', '.join(turned) or 'none'}"]
    if silent:
        lines.append(f"  weight does not tell of {', '.join(silent)}: taken as the file counts")
    zeros = zip(joints, place.arm.zero, place.zero_sd, strict=True)
    told = [(joint, zero, sd) for joint, zero, sd in zeros if joint not in silent]
    lines.append(f"zeros [mrad]: {in_mrad(told) or 'not told'}")
    tilts = list(zip("xy", place.tilt, place.tilt_sd, strict=True))
    lines.append(f"base tilted [mrad] about {in_mrad(tilts)}")
    if known.arm.floor is not None:
        lines.append(f"the tip rests on something {1e3 * known.arm.floor:.0f} mm above the base")
    return lines


def servo_lines(answer: ArmAnswer) -> list[str]:
    """Say what each servo has, whether it was fitted with the arm or named as a cause."""
    lines = ["", "servos, as their model.toml has them, with what was fitted before any cause:"]
    for joint, one in answer.servos.items():
        model, scale = answer.models[joint], one.scale
        parts = [cause_text(e.cause, numbers_of(e), scale) for e in model.effects]
        if isinstance(given := model.actuator.values.get("compliance"), float):
            parts.insert(0, f"compliance {quantity(given, 'rad/(N m)')}")
        lines.append(f"  {joint:18s} {'; '.join(parts) or 'follows its command'}")
    return lines


def in_mrad(angles: Sequence[tuple[str, float, float]]) -> str:
    """Write angles with twice their standard deviations [rad] after what they are of."""
    return ", ".join(f"{of} {1e3 * angle:.0f} +- {2e3 * sd:.0f}" for of, angle, sd in angles)


def error_lines(answer: ArmAnswer) -> list[str]:
    """Return the table of errors on test recordings [mrad]."""
    lines = [
        "",
        "held-out RMS [mrad]: the start and the diagnosis, loaded by what the arm did; then",
        "plain servos and the diagnosis, all servos together under their commands alone",
    ]
    for joint, one in answer.servos.items():
        errors = (one.baseline.theta_rmse, one.extended.theta_rmse,
                  answer.plain[joint], answer.together[joint])  # fmt: skip
        lines.append(f"  {joint:18s}" + " ".join(f"{1e3 * error:8.1f}" for error in errors))
    return [*lines, *names_line(answer.plain, answer.together)]


def names_line(plain: Mapping[str, float], together: Mapping[str, float]) -> list[str]:
    """Say of which joints causes predict no better than plain servos, from both RMS [rad]."""
    same = [j for j, error in together.items() if error**2 >= (1.0 - BETTER) * plain[j] ** 2 > 0.0]
    if not same:
        return []
    return [f"of {', '.join(same)} nothing is to be named beyond a plain servo: its causes take "
            f"less than {100 * BETTER:.0f} % of the squared error away"]  # fmt: skip

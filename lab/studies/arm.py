"""Real SO-101 logs: all servos of an arm at once, ``python -m lab.studies.arm LOGS``.

For three pairs of training motions of each joint: how the arm
stands, what its tip rests on and a plain model of each servo are found on the two motions. The
causes of one joint are looked for under the loads of the arm. All other motions are then simulated
from the commands alone, all servos together. Beside it stand the plain servos of that arm, and
lag, delay, deadband and offset of the joint alone. All start behind the acceleration that LeRobot
writes. ``LOGS`` holds ``so101.urdf`` beside the motions. Every pair that is finished stands in
``--out``, its median and worst motion in ``--pictures``.
"""

import argparse
import json
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from lab.studies.arm_figure import draw
from lab.studies.so101_pairs import TOLD, causes, drawn, fixed_fit, joints, moving, split, squares
from tendon_lab.foreign_logs.so101 import read_so101
from tendon_newton.arms.arm import ArmMotion
from tendon_newton.arms.arm_simulation import SimulatedMotion, simulate_arm
from tendon_newton.arms.known_arm import each_servo, know_arm
from tendon_newton.data.importers.imported import Imported
from tendon_newton.data.recording import Array, Mask, Recording
from tendon_newton.diagnosis.diagnose import diagnose
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.study import Study
from tendon_newton.mechanisms.authoring.foreign_file import read_foreign
from tendon_newton.mechanisms.authoring.foreign_plan import plan_foreign, write_foreign
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism

TIP = ("gripper", (-0.0079, -0.0002, -0.0981))
"""Link and place [m] of the fixed jaw's tip, from the arm's public description."""
PAIRS = 3  # Pairs of training motions of each joint
DRAWS = 2000  # Resamplings of the pairs for an interval


@dataclass(frozen=True, kw_only=True)
class ArmResult:
    """What one pair of training motions led to for one joint: mean squared errors [rad2]."""

    joint: str
    train: tuple[str, str]
    told: float  # Of a servo that is where it was told to be
    fixed: float  # Of lag, delay, deadband and offset of this joint alone
    plain: float  # Of the arm with plain servos
    found: float  # Of the arm with this joint's causes
    signs: tuple[float, ...]
    floor: float | None  # [m]
    compliance: float | None  # Of the diagnosed servo [rad/(N m)]
    causes: str


def main() -> None:
    """Diagnose on each pair that is not done yet, then print all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path)
    parser.add_argument("--joint", action="append", help="joints: all by default")
    parser.add_argument("--out", type=Path, default=Path("arm.jsonl"))
    parser.add_argument("--pictures", type=Path, help="folder for pictures of each pair's motions")
    arguments = parser.parse_args()
    imported = read_so101(arguments.logs)
    mechanism = mechanism_of(arguments.logs / "so101.urdf")
    done = read_results(arguments.out)
    for joint in arguments.joint or joints(imported):
        logs = [log for log in imported.logs if log.conditions["joint"] == joint]
        for pair in drawn(list(combinations(moving(logs), 2)), PAIRS):
            if (joint, pair) not in done:
                done[joint, pair] = one_pair(imported, mechanism, joint, pair, arguments.pictures)
                with arguments.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(asdict(done[joint, pair])) + "\n")
    report(list(done.values()))


def mechanism_of(urdf: Path) -> Mechanism:
    """Import an arm's description as an asset, and load it."""
    link, place = TIP
    plan = plan_foreign(
        "arm", read_foreign(urdf), tip=place, tip_link=link, spool_radius=0.01, force_limit=3.0
    )
    with tempfile.TemporaryDirectory() as folder:
        return load_mechanism(write_foreign(Path(folder), plan))


def motions_by_name(imported: Imported) -> dict[str, ArmMotion]:
    """Return the motions of all joints."""
    by_motion: dict[str, list[Recording]] = {}
    for log in imported.logs:
        by_motion.setdefault(str(log.conditions["motion"]), []).append(log.recording)
    return {name: ArmMotion(recordings=tuple(own)) for name, own in by_motion.items()}


def one_pair(
    imported: Imported,
    mechanism: Mechanism,
    joint: str,
    pair: tuple[str, str],
    pictures: Path | None,
) -> ArmResult:
    """Diagnose a joint on two motions of its arm, and simulate the arm in all others."""
    motions = motions_by_name(imported)
    seen = [motions[name] for name in pair]
    own = {name: [log for log in imported.logs if log.conditions["joint"] == name]
           for name in joints(imported)}  # fmt: skip
    known = know_arm(mechanism, seen, [imported.start_model(logs) for logs in own.values()])
    place = list(own).index(joint)
    names = [name for name in motions if name not in pair]
    others = [motions[name] for name in names]
    weights = [known.arm.weight(motion.angles) for motion in others]
    start = imported.start_model(own[joint])
    with tempfile.TemporaryDirectory() as folder:
        dataset = split(Path(folder), own[joint], pair)
        train, test = known.with_loads(seen)[place], each_servo(others, weights)[place]
        diagnosis, _ = diagnose(replace(dataset, train=train, test=test), known.starts[place])
    study, alone = (Study(dataset.test, model, tuple(EFFECTS)) for model in (TOLD, start))
    numbers = fixed_fit(start, Study(dataset.train, start, tuple(EFFECTS)))
    (told,), (fixed,) = squares(study, [{}]), squares(alone, [numbers])
    trusted = [study.timeline(i).trusted for i in range(len(dataset.test))]
    models = dict(enumerate(known.plain))
    plain = arm_squares(simulate_arm(known.arm, models, others), others, place, trusted)
    models[place] = servo = known.servo(place, diagnosis)
    states = simulate_arm(known.arm, models, others)
    found = arm_squares(states, others, place, trusted)
    if pictures is not None:
        draw(pictures / f"{joint}_{'_'.join(pair)}.png", place, names, others, states, found)
    compliance = servo.actuator.values.get("compliance")
    return ArmResult(
        joint=joint, train=pair, told=mean(told), fixed=mean(fixed), plain=mean(plain),
        found=mean(found), signs=tuple(known.arm.sign.tolist()), floor=known.arm.floor,
        compliance=None if compliance is None else float(compliance), causes=causes(diagnosis),
    )  # fmt: skip


def arm_squares(
    states: Sequence[SimulatedMotion],
    motions: Sequence[ArmMotion],
    joint: int,
    trusted: Sequence[Mask],
) -> list[Array]:
    """Return one joint's squared errors [rad2] by motion, where its shaft is free."""
    return [
        (state.angles - motion.angles)[rows, joint] ** 2
        for state, motion, rows in zip(states, motions, trusted, strict=True)
    ]


def mean(squares: Sequence[Array]) -> float:
    """Return the mean over all rows of all motions."""
    return float(np.concatenate(squares).mean())


def read_results(path: Path) -> dict[tuple[str, tuple[str, str]], ArmResult]:
    """Read the pairs that an earlier run finished."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    rows = [json.loads(line) for line in lines]
    results = [ArmResult(**{**row, "train": tuple(row["train"]), "signs": tuple(row["signs"])})
               for row in rows]  # fmt: skip
    return {(result.joint, result.train): result for result in results}


def report(results: Sequence[ArmResult]) -> None:
    """Print each pair, the RMS of each joint, and the shares that are left, with intervals."""
    for result in results:
        errors = " ".join(f"{1e3 * getattr(result, name) ** 0.5:5.1f}" for name in NAMES)
        floor = "none" if result.floor is None else f"{1e3 * result.floor:.0f} mm"
        print(f"{result.joint:12s} {errors} mrad  {' + '.join(result.train)}; floor {floor}; "
              f"{result.causes}")  # fmt: skip
    table = np.array([[getattr(result, name) for name in NAMES] for result in results])
    for joint in dict.fromkeys(result.joint for result in results):
        rms = 1e3 * np.sqrt(table[[r.joint == joint for r in results]].mean(axis=0))
        print(f"{joint:12s} " + ", ".join(f"{n} {v:.1f}" for n, v in zip(NAMES, rms, strict=True)))
    rng = np.random.default_rng(0)
    draws = table[rng.integers(len(table), size=(DRAWS, len(table)))].sum(axis=1)
    for k, name in enumerate(NAMES[1:], start=1):
        low, high = np.quantile(draws[:, k] / draws[:, 0], [0.025, 0.975])
        share = table[:, k].sum() / table[:, 0].sum()
        alike = np.mean(table[:, k] / table[:, 0])
        print(f"{name}: {share:.3f} [{low:.3f}, {high:.3f}] of the squared error is left over "
              f"{len(table)} pairs, {alike:.3f} where each counts alike")  # fmt: skip


NAMES = ("told", "fixed", "plain", "found")  # What is compared

if __name__ == "__main__":
    main()

"""A whole arm carried into another program, and how far it strays there from our own simulation."""

from collections.abc import Callable, Mapping, Sequence
from math import inf
from pathlib import Path

import numpy as np

from tendon_newton.arms.arm import Arm, ArmMotion, motions_of
from tendon_newton.arms.arm_file import IdentifiedArm, without
from tendon_newton.arms.arm_simulation import simulate_arm
from tendon_newton.data.dataset import dataset_folders, load_dataset
from tendon_newton.data.excitations import RATE
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.effects import find_effect
from tendon_newton.exports.departure import Departure, pooled
from tendon_newton.exports.export_page import Fidelity, told_lines, write_page
from tendon_newton.exports.export_target import Exported
from tendon_newton.exports.model_numbers import nearly, not_exact
from tendon_newton.exports.mujoco import arm_target
from tendon_newton.identification.cutting import first_part
from tendon_newton.mechanisms.geometry.kinematics import posture
from tendon_newton.mechanisms.geometry.parts import Tip

ALONE = f"{arm_target.FILE} alone"
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
    recordings = {
        folder.name: first_part(load_dataset(folder, require_train=False).test, seconds)
        for folder in dataset_folders(dataset)
    }
    return motions_of(recordings, arm.mechanism.joint_names)


def swings(arm: Arm) -> ArmMotion:
    """Return commands that swing each joint about the middle of its range."""
    time = np.arange(round(STANDARD_SECONDS * RATE)) / RATE
    rates = np.linspace(*STANDARD_RATES, len(arm.sign))
    command = arm_target.middle_of(arm) + arm_target.SWING * np.sin(np.outer(time, rates))
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
    out: Path, arm: IdentifiedArm, motions: Sequence[ArmMotion], progress: Callable[[str], None]
) -> list[str]:
    """Write an arm for MuJoCo, with a page that says how far it strays; return its lines.

    Raises:
        InvalidModelFile: A number of a servo is missing or out of range.
        InvalidOutput: A file cannot be written.
    """
    has = {arm_target.PROGRAM: arm_target.COVERAGE, ALONE: arm_target.IN_THE_FILE}
    left_out, in_another_form = (
        {way: tuple(sorted({e for m in arm.models for e in which(m, has[way])})) for way in has}
        for which in (not_exact, nearly)
    )
    exported = Exported(
        files=arm_target.write_arm(out, arm), loading=loading_text(arm), left_out=left_out,
        nearly=in_another_form,
    )  # fmt: skip
    ours = simulated(arm, motions)
    progress(f"replaying {sum(motion.time[-1] - motion.time[0] for motion in motions):.0f} s")
    ways: Mapping[str, Callable[[ArmMotion], Array]] = {
        arm_target.PROGRAM: lambda motion: arm_target.replay_arm_program(out, motion),
        ALONE: lambda motion: arm_target.replay_arm_file(out, arm.arm, motion),
    }
    worth = {
        effect: strayed(arm.arm, simulated(without(arm, effect), motions), ours)
        for effect in sorted({name for names in left_out.values() for name in names})
    }
    fidelity = Fidelity(
        runs=tuple(motion.recordings[0].name for motion in motions),
        replays={
            way: strayed(arm.arm, [replay(motion) for motion in motions], ours)
            for way, replay in ways.items()
        },
        costs={way: {e: worth[e] for e in names} for way, names in left_out.items() if names},
    )
    write_page(out, f"{arm.arm.mechanism.name}, for mujoco", exported, fidelity)
    return told_lines(fidelity, exported)


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


def loading_text(arm: IdentifiedArm) -> str:
    """Return how a user loads the files, and which servo has what."""
    rows = [
        f"| {joint} | {sign:+.0f} | {1e3 * zero:.0f} mrad | {model_text(model)} |"
        for joint, sign, zero, model in zip(
            arm.arm.mechanism.joint_names, arm.arm.sign, arm.arm.zero, arm.models, strict=True
        )
    ]
    return "\n".join([LOADING, "| joint | counts | zero | servo |", "|---|---|---|---|", *rows])


def model_text(model: Model) -> str:
    """Return a servo's causes with their numbers."""
    compliance = model.actuator.values.get("compliance", 0.0)
    told = [f"compliance {compliance:.3g} rad/(N m)"] if compliance else []
    for effect in model.effects:
        units = {p.name: p.unit for p in find_effect(effect.name).parameters}
        numbers = ", ".join(f"{v:.3g} {units[k]}" for k, v in effect.values.items())
        told.append(f"{effect.name} {numbers}")
    return "; ".join(told) or "none"


LOADING = """```sh
pip install mujoco
python arm_step.py                                     # some steps and ramps
python arm_step.py commands.csv --out replay.csv       # columns t [s] and theta_d_0, theta_d_1 ...
```

In a program of your own:

```python
import mujoco, arm_step

model = mujoco.MjModel.from_xml_path("arm.xml")
model.opt.timestep = 2.0e-3
hook = arm_step.make_hook(model, mujoco.MjData(model))
hook.reset(angles)          # [rad] as the servos count, one per joint
hook.command[:] = command   # the same
hook.step()                 # in place of mujoco.mj_step
print(hook.read())          # what the encoders report [rad]
```

`arm.xml` also runs alone, in MuJoCo and mujoco_warp: its controls are what the servos are told. A
servo is then a spring as soft as its compliance with the damping of its lag, and dry friction that
holds it within its deadband. A joint's angle is
that of its servo, turned round where it counts the other way, and the zero. Shapes of the arm
neither weigh nor touch, but for the tip on its floor.
"""

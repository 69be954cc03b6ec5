"""An arm of two servos by other equations than the package's, and its description as URDF."""

from pathlib import Path

import numpy as np

from tendon_newton.arms.arm import ArmMotion
from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.authoring.foreign_file import read_foreign
from tendon_newton.mechanisms.authoring.foreign_plan import plan_foreign, write_foreign
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tests.made import recorded

MASS, LENGTH, GRAVITY = 0.3, 0.2, 9.81  # kg, m, m/s2 of both links, slender rods
COMPLIANCE = 0.08  # rad/(N m)
BANDS = (0.02, 0.03)  # rad
SIGNS = np.array([1.0, -1.0])
ROW = 0.02  # s
LINK = f"""<link name="{{name}}"><inertial><origin xyz="{LENGTH / 2} 0 0"/><mass value="{MASS}"/>
  <inertia ixx="1e-6" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>
  <origin xyz="{place} 0 0"/><axis xyz="0 1 0"/>
  <limit lower="-2" upper="2" effort="3" velocity="10"/></joint>"""
URDF = "".join(
    [
        '<robot name="arm"><link name="base"/>',
        LINK.format(name="upper"),
        LINK.format(name="fore"),
        JOINT.format(name="shoulder", parent="base", child="upper", place=0),
        JOINT.format(name="elbow", parent="upper", child="fore", place=LENGTH),
        "</robot>",
    ]
)


def planted_mechanism(folder: Path) -> Mechanism:
    """Import the description; its tip is the end of the second rod."""
    source = folder / "arm.urdf"
    source.write_text(URDF, encoding="utf-8")
    plan = plan_foreign(
        "arm", read_foreign(source), tip=(LENGTH, 0.0, 0.0), spool_radius=0.01, force_limit=3.0
    )
    return load_mechanism(write_foreign(folder, plan))


def weight(q: Array, tilt: float = 0.0) -> Array:
    """Torque of gravity about both axes, which point to +y: down is positive, shape (2,).

    A base that is tipped about +y by some angle [rad] turns both rods with it.
    """
    first, second = np.cos(q[0] + tilt), np.cos(q[0] + q[1] + tilt)
    fore = MASS * GRAVITY * 0.5 * LENGTH * second
    return np.array([MASS * GRAVITY * (1.5 * LENGTH * first + 0.5 * LENGTH * second), fore])


def tip(q: Array) -> float:
    """Height of the tip [m]."""
    return float(-LENGTH * (np.sin(q[0]) + np.sin(q[0] + q[1])))


def hang(command: Array, floor: float, tilt: float) -> Array:
    """Joints that give way to their weight and rest in a band, with a floor, shape (T, 2)."""
    out, q = [], command[0] + COMPLIANCE * weight(command[0], tilt)
    for goal in command:
        push = 0.0
        before = q
        for _ in range(200):
            slopes = -LENGTH * np.array([np.cos(q[0]) + np.cos(q[0] + q[1]), np.cos(q[0] + q[1])])
            rest = goal + COMPLIANCE * (weight(q, tilt) + push * slopes)
            last, q = (push, q), np.clip(before, rest - BANDS, rest + BANDS)
            push = max(push + 0.5 * (floor - tip(q)) / (COMPLIANCE * slopes @ slopes), 0.0)
            if push == last[0] and np.array_equal(q, last[1]):
                break
        out.append(q)
    return np.array(out)


def planted_motion(
    name: str, rng: np.random.Generator, low: float, floor: float, tilt: float = 0.0, late: int = 0
) -> ArmMotion:
    """A slow motion about a posture with the shoulder so low [rad]; the elbow counts backwards.

    Servos hear their commands so many rows late.
    """
    time = ROW * np.arange(500, dtype=np.float64)
    phase = rng.uniform(0.0, 6.0, (2, 2))
    swing = [0.25 * np.sin(0.9 * time + a) + 0.15 * np.sin(2.3 * time + b) for a, b in phase]
    command = np.column_stack(swing) + np.array([low, 0.1])
    heard = command[np.maximum(np.arange(len(time)) - late, 0)]
    angles = SIGNS * (hang(heard, floor, tilt) + 1e-4 * rng.standard_normal(command.shape))
    return ArmMotion(
        recordings=tuple(
            recorded(
                time,
                angle,
                name=f"{joint}_{name}.csv",
                command=goal,
                motor_velocity=np.gradient(angle, ROW),
                start="first_row",
            )
            for joint, goal, angle in zip(
                ("shoulder", "elbow"), (SIGNS * command).T, angles.T, strict=True
            )
        )
    )

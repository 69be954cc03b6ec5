"""Two fingers press against each other: ``python -m lab.studies.pinch`` prints and draws it.

The picture goes to ``docs/images/pinch.png``.
"""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import torch

from lab.studies.contact import COLORS, GREY, RADII, capsule_outline
from tendon_newton.data.files.picture import new_figure, save, tidy
from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tests.physics.contact.pinches import axes_of, pinch, press
from tests.physics.runs import ideal_model

ROOT = Path(__file__).resolve().parents[2]
PICTURE = ROOT / "docs" / "images" / "pinch.png"
RATE = 200.0  # Hz
CLOSING, HOLDING = 1.0, 0.5  # s
OPEN, PRESSED = np.array([0.3, 0.5]), np.array([2.0, 1.2])  # rad
FRICTIONS = (0.0, 0.8)  # Smooth fingers, and ones that stick


def main() -> None:
    """Close two fingers on each other, smooth and rough."""
    with tempfile.TemporaryDirectory() as folder:
        mechanism = pinch(Path(folder))
    loop = ControlLoop(mechanism, ideal_model(), len(FRICTIONS), rate=RATE, device="cpu")
    friction = torch.tensor(FRICTIONS, dtype=torch.float64)
    loop.bench_numbers("obstacle_friction").copy_(friction[:, None])
    joints, forces, tensions = close(loop)
    draw(mechanism, joints, forces, tensions)
    capsule, met = np.argwhere(forces[-1, 0].any(axis=-1))[0]
    expected, _ = press(mechanism, joints[-1, 0], int(capsule), int(met))
    print("at rest, N: simulated, and stiffness times depth by hand")
    print(f"  smooth: {np.linalg.norm(forces[-1, 0]):.4f}  {np.linalg.norm(expected):.4f}")
    print(f"  rough: {np.linalg.norm(forces[-1, 1]):.4f}")
    for world, kind in enumerate(("smooth", "rough")):
        left, right = tensions[-1, world]
        print(f"  tensions, {kind}: {left:.3f} N and {right:.3f} N")
    print(f"wrote {PICTURE.relative_to(ROOT)}")


def close(loop: ControlLoop) -> tuple[Array, Array, Array]:
    """Close, hold and return joints (T, W, J), contacts (T, W, C, O, 3) and tensions (T, W, D)."""
    ramp = np.linspace(0.0, 1.0, round(CLOSING * RATE))
    ways = np.concatenate([ramp, np.ones(round(HOLDING * RATE))])
    commands = torch.tensor(OPEN + ways[:, None] * (PRESSED - OPEN), dtype=torch.float32)
    worlds = loop.world_count
    loop.reset(commands[0].repeat(worlds, 1))
    joints, forces, tensions = [], [], []
    for command in commands:
        reading = loop.step(command.repeat(worlds, 1))
        joints.append(reading.joint_position.numpy().astype(np.float64))
        forces.append(loop.contact_forces().numpy().astype(np.float64).copy())
        tensions.append(reading.force.numpy().astype(np.float64).copy())
    return np.array(joints), np.array(forces), np.array(tensions)


def draw(mechanism: Mechanism, joints: Array, forces: Array, tensions: Array) -> None:
    """Draw postures beside the forces over time."""
    figure = new_figure(10.5, 4.2)
    scene, plot = figure.subplots(1, 2)
    draw_scene(scene, mechanism, joints[:, 1])
    time = np.arange(len(tensions)) / RATE
    for world, (line, kind) in enumerate((("--", "smooth"), ("-", "rough"))):
        force = np.linalg.norm(forces[:, world].sum(axis=(1, 2)), axis=-1)
        plot.plot(time, force, line, color=COLORS[2], label=f"between the fingers, {kind}")
        for tendon, side in enumerate(("left", "right")):
            tension = tensions[:, world, tendon]
            plot.plot(time, tension, line, color=COLORS[tendon], label=f"{side} tendon, {kind}")
    plot.set_xlabel("time [s]")
    plot.set_ylabel("force [N]")
    plot.legend(frameon=False, fontsize=9)
    for axes in (scene, plot):
        tidy(axes)
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    save(figure, PICTURE, dpi=120)


def draw_scene(scene: Any, mechanism: Mechanism, joints: Array) -> None:
    """Draw some postures of both fingers."""
    for row in np.linspace(0, len(joints) - 1, 4).astype(int):
        last = row == len(joints) - 1
        for capsule, (start, end, _) in enumerate(axes_of(mechanism, joints[row])):
            ends = 1e3 * np.array([start, end])[:, [0, 2]]
            outline = capsule_outline(ends[0], ends[1], 1e3 * RADII[capsule % 2])
            color = COLORS[capsule // 2] if last else GREY
            scene.fill(*outline.T, color=color, alpha=0.9 if last else 0.2, linewidth=0.0)
    scene.set_aspect("equal")
    scene.set_xlabel("x [mm]")
    scene.set_ylabel("z [mm]")


if __name__ == "__main__":
    main()

"""A finger closes on a ball and a stop: ``python -m lab.studies.contact`` prints and draws it.

The picture goes to ``docs/images/contact.png``.
"""

from pathlib import Path
from typing import Any

import numpy as np
import torch

from tendon_newton.data.files.picture import new_figure, save, tidy
from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.kinematics import posture
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.obstacles import Sphere
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tests.physics.contact.bodies import ball, ball_torque
from tests.physics.runs import ideal_model

ROOT = Path(__file__).resolve().parents[2]
PICTURE = ROOT / "docs" / "images" / "contact.png"
RATE = 200.0  # Hz
CLOSING, HOLDING = 1.0, 0.5  # s
CLOSED = 4.0  # rad
INK, GREY, COLORS = "#2b2f36", "#8a8f98", ("#d1603d", "#1f6f8b", "#6b8f3a")
RADII = (0.0040, 0.0035)  # m, of the phalanges
FRICTIONS = (0.0, 0.5)  # A smooth ball, and one that sticks


def main() -> None:
    """Close the finger on the ball, smooth and rough."""
    mechanism, sphere = load_mechanism("finger"), ball()
    loop = ControlLoop(
        mechanism.with_obstacles(sphere), ideal_model(), len(FRICTIONS), rate=RATE, device="cpu"
    )
    loop.bench_numbers("obstacle_friction")[:, 0] = torch.tensor(FRICTIONS, dtype=torch.float64)
    joints, forces, tensions = close(loop)
    draw(mechanism, sphere, joints, forces, tensions)
    expected = ball_torque(mechanism, sphere, joints[-1, 0])[1]
    print("at rest on the smooth ball, N: simulated, and stiffness times depth by hand")
    for name, found, wanted in zip(
        ("middle phalanx", "distal phalanx"), forces[-1, 0], expected, strict=True
    ):
        print(f"  {name}: {np.linalg.norm(found):.4f}  {wanted:.4f}")
    print(f"  tension: {tensions[-1, 0]:.3f} N; on the rough ball {tensions[-1, 1]:.3f} N")
    print(f"wrote {PICTURE.relative_to(ROOT)}")


def close(loop: ControlLoop) -> tuple[Array, Array, Array]:
    """Close, hold and return joints (T, W, J), contact forces (T, W, C, 3) and tensions (T, W)."""
    ramp = np.linspace(0.0, CLOSED, round(CLOSING * RATE))
    commands = np.concatenate([ramp, np.full(round(HOLDING * RATE), CLOSED)])
    worlds = loop.world_count
    loop.reset(torch.zeros(worlds, 1))
    joints, forces, tensions = [], [], []
    for command in commands:
        reading = loop.step(torch.full((worlds, 1), float(command)))
        joints.append(reading.joint_position.numpy().astype(np.float64))
        forces.append(loop.contact_forces()[:, :, 0].numpy().astype(np.float64).copy())
        tensions.append(reading.force[:, 0].numpy().astype(np.float64).copy())
    return np.array(joints), np.array(forces), np.array(tensions)


def bones(mechanism: Mechanism, q: Array) -> Array:
    """Return where joints and tip are [m], x and z, shape (J + 1, 2)."""
    frames, tip = posture(mechanism, q), mechanism.tip
    assert tip is not None
    return np.array([*frames.anchor, frames.place(tip.body, tip.point)])[:, [0, 2]]


def draw(
    mechanism: Mechanism, sphere: Sphere, joints: Array, forces: Array, tensions: Array
) -> None:
    """Draw postures beside the forces over time."""
    figure = new_figure(10.5, 4.2)
    scene, plot = figure.subplots(1, 2)
    draw_scene(scene, mechanism, sphere, joints[:, 1])
    time = np.arange(len(tensions)) / RATE
    for link, name in enumerate(("middle phalanx", "distal phalanx")):
        for world, (line, kind) in enumerate((("--", "smooth"), ("-", "rough"))):
            force = np.linalg.norm(forces[:, world, link], axis=-1)
            plot.plot(time, force, line, color=COLORS[link], label=f"{name}, {kind} ball")
    plot.plot(time, tensions[:, 1], color=GREY, label="tendon")
    plot.set_xlabel("time [s]")
    plot.set_ylabel("force [N]")
    plot.legend(frameon=False, fontsize=9)
    for axes in (scene, plot):
        tidy(axes)
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    save(figure, PICTURE, dpi=120)


def capsule_outline(start: Array, end: Array, radius: float) -> Array:
    """Return the outline of a phalanx, shape (N, 2)."""
    along = (end - start) / np.linalg.norm(end - start)
    turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 30)[:, None]
    across = np.array([-along[1], along[0]])
    cap = radius * (np.cos(turn) * along + np.sin(turn) * across)
    return np.concatenate([end + cap, start - cap])


def draw_scene(scene: Any, mechanism: Mechanism, sphere: Sphere, joints: Array) -> None:
    """Draw the ball, some postures, and the way of the tip."""
    from matplotlib.patches import Circle

    centre = 1e3 * sphere.position[[0, 2]]
    scene.add_patch(Circle(tuple(centre), 1e3 * sphere.radius, color="#f0d9a8"))
    tips = 1e3 * np.array([bones(mechanism, q)[-1] for q in joints])
    scene.plot(tips[:, 0], tips[:, 1], color=COLORS[2], linewidth=1.2, label="way of the tip")
    for row in np.linspace(0, len(joints) - 1, 6).astype(int):
        last = row == len(joints) - 1
        points = 1e3 * bones(mechanism, joints[row])
        for link in range(2):
            outline = capsule_outline(points[link], points[link + 1], 1e3 * RADII[link])
            scene.fill(
                *outline.T,
                color=COLORS[link] if last else GREY,
                alpha=0.9 if last else 0.2,
                linewidth=0.0,
            )
    scene.set_aspect("equal")
    scene.set_xlabel("x [mm]")
    scene.set_ylabel("z [mm]")
    scene.legend(frameon=False, fontsize=9, loc="lower right")


if __name__ == "__main__":
    main()

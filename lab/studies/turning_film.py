"""Draw a film of a virtual hand from a deployment's log, with MuJoCo's renderer.

``MUJOCO_GL=osmesa python -m lab.studies.turning_film LOG --out FILE.gif`` needs no display; a
computer with a graphics card may have ``MUJOCO_GL=egl``.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from tendon_hardware.deployment.turning_report import read_truth
from tendon_hardware.virtual_bench.physics.scene import SCENES, import_mujoco
from tendon_newton.data.recording import Array
from tendon_newton.errors import MissingDependency

WIDTH, HEIGHT = 640, 480
AZIMUTH, ELEVATION, DISTANCE = 95.0, 15.0, 0.17
"""Where the eye is [deg, deg, m]: beside the index finger, along the axis of the turn. Gravity
points along +z, so that the eye is below the palm."""
LOOKED_AT = (0.015, 0.0, -0.022)  # [m], in the frame of the hand
PAPER = (0.98, 0.98, 0.98)  # Colour behind the hand
COLORS = 32  # Of a frame, so that a page can show the film
SPOT = 0.35  # Size of the balls that stand out of the ball as spots, as a share of it [1]


def main() -> None:
    """Draw the film."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("log", type=Path)
    parser.add_argument("--out", type=Path, default=Path("turning.gif"))
    parser.add_argument("--begin", type=float, default=0.0, help="[s]")
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--rate", type=float, default=15.0, help="frames per second [Hz]")
    words = parser.parse_args()
    time, pose, joints = read_truth(words.log)
    instants = np.arange(words.begin, words.begin + words.seconds, 1.0 / words.rate)
    rows = np.unique(np.searchsorted(time - time[0], instants).clip(0, len(time) - 1))
    frames = drawn(pose[rows], joints[rows])
    images = [Image.fromarray(frame).quantize(COLORS) for frame in frames]
    images[0].save(
        words.out, save_all=True, append_images=images[1:], duration=1e3 / words.rate, loop=0
    )
    print(f"{words.out}: {len(images)} frames, {words.out.stat().st_size / 1e6:.2f} MB")


def drawn(pose: Array, joints: Array) -> list[Array]:
    """Return a picture of each row, as MuJoCo draws the scene.

    Args:
        pose: Places [m] and quaternions (x, y, z, w) of the ball, shape (T, 7).
        joints: Joint angles [rad], shape (T, J).

    Raises:
        MissingDependency: MuJoCo cannot draw here.
    """
    mujoco, model, renderer = prepared()
    data = mujoco.MjData(model)
    eye = mujoco.MjvCamera()
    eye.lookat[:] = LOOKED_AT
    eye.azimuth, eye.elevation, eye.distance = AZIMUTH, ELEVATION, DISTANCE
    frames: list[Array] = []
    for place, angles in zip(pose, joints, strict=True):
        data.qpos[:] = [*angles, *place[:3], place[6], *place[3:6]]
        mujoco.mj_forward(model, data)
        renderer.update_scene(data, eye)
        frames.append(upside_down(renderer.render()))
    renderer.close()
    return frames


def prepared() -> tuple[Any, Any, Any]:
    """Return MuJoCo, the scene and what draws the scene.

    Raises:
        MissingDependency: There is no library that draws without a display.
    """
    try:
        mujoco = import_mujoco()
        model = spotted(mujoco)
        return mujoco, model, mujoco.Renderer(model, HEIGHT, WIDTH)
    except MissingDependency:
        raise
    except Exception as error:  # each library fails in its own way, some while they are loaded
        raise MissingDependency(
            "MuJoCo must be able to draw; set MUJOCO_GL=osmesa with the system's package "
            "libosmesa6, or MUJOCO_GL=egl with a graphics card"
        ) from error


def spotted(mujoco: Any) -> Any:
    """Return the scene in good light, with spots on the ball so that one sees it turn."""
    spec = mujoco.MjSpec.from_file(str(SCENES / "hand_ball.xml"))
    ball = spec.body("ball")
    radius = float(spec.geom("ball").size[0])
    for axis in (*np.eye(3), *-np.eye(3)):
        ball.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[SPOT * radius, 0.0, 0.0],
            pos=(1.02 - SPOT) * radius * axis,
            mass=0.0,
            rgba=[0.97, 0.95, 0.88, 1.0],
        )
    spec.add_texture(
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
        rgb1=PAPER,
        rgb2=PAPER,
        width=16,
        height=96,
    )
    model = spec.compile()
    model.vis.headlight.ambient[:] = 0.4
    model.vis.headlight.diffuse[:] = 0.8
    return model


def upside_down(frame: Array) -> Array:
    """Turn a picture, since gravity points up in the hand's frame."""
    return np.ascontiguousarray(frame[::-1, ::-1])


if __name__ == "__main__":
    main()

"""A mechanism as MJCF for plain MuJoCo: Newton's own export, with a motor on each tendon."""

from __future__ import annotations

import contextlib
import io
import tempfile
from pathlib import Path
from typing import Any

import newton
import numpy as np
from newton.solvers import SolverMuJoCo

from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.recording import BenchOverrides
from tendon_newton.errors import InvalidAsset
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.worlds import build_model

TIME_STEP = 5.0e-4
"""Step [s]: the stops of a light link ring at more than MuJoCo's own 2 ms can follow."""
DRAWN = {
    int(newton.GeoType.SPHERE): "mjGEOM_SPHERE",
    int(newton.GeoType.CAPSULE): "mjGEOM_CAPSULE",
    int(newton.GeoType.CYLINDER): "mjGEOM_CYLINDER",
    int(newton.GeoType.BOX): "mjGEOM_BOX",
}
"""Shapes that both draw alike."""


def write_mujoco(path: Path, mechanism: Mechanism) -> None:
    """Write a mechanism as MJCF.

    The control of a motor is the tension [N] at its tendon. Spool, servo and effects stay behind:
    what they do is a program's business in MuJoCo.

    Args:
        path: The file; replaced if it is there.
        mechanism: The bench.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    spec = mujoco_spec(mechanism)
    for tendon in mechanism.tendons:
        add_motor(spec, tendon.name, tendon.force_limit, direct=tendon.direct)
    write_spec(path, spec)


def mujoco_spec(mechanism: Mechanism) -> Any:
    """Return a mechanism, with its own numbers, as MuJoCo's editable model without actuators.

    Raises:
        InvalidAsset: Two joints or tendons share the last part of their paths.
        InvalidParameter: An obstacle has a mass.
    """
    mechanism.refuse_moving_obstacle("an MJCF file")
    names = [*mechanism.joint_names, *(tendon.name for tendon in mechanism.tendons)]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InvalidAsset(
            "MJCF calls joints and tendons by the last part of their paths, which "
            f"{mechanism.name} has more than once: {', '.join(twice)}; export one finger of it"
        )
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        draft = Path(folder) / "export.xml"
        model = build_model(mechanism, 1, overrides=[BenchOverrides()], device="cpu")
        solver: Any = SolverMuJoCo(model, disable_contacts=True, save_to_mjcf=str(draft))
        text = short_names(draft.read_text(encoding="utf-8"), mechanism)
    spec = newton_s_mujoco().MjSpec.from_string(text)
    spec.modelname = mechanism.name
    spec.option.timestep = TIME_STEP
    for joint, stop in zip(spec.joints, solver.mj_model.jnt_solref, strict=True):
        joint.solref_limit = stop  # the export leaves the end stops at MuJoCo's default
    draw_shapes(spec, mechanism)
    return spec


def write_spec(path: Path, spec: Any) -> None:
    """Write MuJoCo's editable model as MJCF.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    spec.compile()
    write_text(path, spec.to_xml())


def newton_s_mujoco() -> Any:
    """Return the MuJoCo that Newton brings along, whose version is its own."""
    return SolverMuJoCo.import_mujoco()[0]


def short_names(text: str, mechanism: Mechanism) -> str:
    """Call prims by the last part of their paths, which are unique in our assets."""
    template = mechanism.template
    prims = [*template.body_label, *template.joint_label]
    for prim in sorted(prims, key=len, reverse=True):
        text = text.replace(f'"{prim.replace("/", "_")}"', f'"{last(prim)}"')
    for tendon in mechanism.tendons:
        text = text.replace(f'"{tendon.prim}"', f'"{tendon.name}"')
    for shape, label in enumerate(template.shape_label):
        text = text.replace(f'"{label}_{shape}"', f'"{last(label)}"')
    return text


def last(prim: str) -> str:
    """Return the last part of a prim's path."""
    return prim.rsplit("/", maxsplit=1)[-1]


def draw_shapes(spec: Any, mechanism: Mechanism) -> None:
    """Add the asset's shapes to be looked at: they neither weigh nor touch."""
    kinds = newton_s_mujoco().mjtGeom
    template = mechanism.template
    for shape, kind in enumerate(template.shape_type):
        is_site = bool(template.shape_flags[shape] & newton.ShapeFlags.SITE)
        if is_site or int(kind) not in DRAWN:
            continue
        owner = template.shape_body[shape]
        body = spec.worldbody if owner < 0 else spec.body(last(template.body_label[owner]))
        place = np.array(template.shape_transform[shape], dtype=np.float64)
        body.add_geom(
            type=getattr(kinds, DRAWN[int(kind)]),
            size=np.array(template.shape_scale[shape], dtype=np.float64),
            pos=place[:3],
            quat=place[[6, 3, 4, 5]],
            contype=0,
            conaffinity=0,
            mass=0.0,
            rgba=[0.86, 0.66, 0.49, 1.0],
        )


def add_motor(spec: Any, tendon: str, limit: float, *, direct: bool) -> None:
    """Add a motor that pulls a tendon; a fixed tendon of ours grows when it is wound in."""
    mujoco = newton_s_mujoco()
    compiled = spec.compile()
    first = compiled.wrap_type[compiled.tendon_adr[compiled.tendon(tendon).id]]
    motor = spec.add_actuator(
        name=tendon,
        trntype=mujoco.mjtTrn.mjTRN_TENDON,
        target=tendon,
        ctrllimited=True,
        ctrlrange=[-limit if direct else 0.0, limit],
    )
    motor.gear[0] = 1.0 if first == mujoco.mjtWrap.mjWRAP_JOINT else -1.0

"""A mechanism as MJCF for plain MuJoCo: Newton's own export, with a motor on each tendon.

Bodies, joints and tendons are called by the last part of their paths. Where two fingers share such
names, the finger's stands before them: `index_mcp`. A shape whose name another link's has as well
is called by its link: `base_knuckle`.
"""

import contextlib
import io
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import newton
import numpy as np
from newton.solvers import SolverMuJoCo

from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.recording import BenchOverrides
from tendon_newton.errors import InvalidAsset
from tendon_newton.mechanisms.authoring.mujoco_contacts import add_obstacles
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.worlds import build_model

# Step [s]: the stops of a light link ring at more than MuJoCo's own 2 ms can follow
TIME_STEP = 5.0e-4
# Shapes that both draw alike
DRAWN = {
    int(newton.GeoType.SPHERE): "mjGEOM_SPHERE",
    int(newton.GeoType.CAPSULE): "mjGEOM_CAPSULE",
    int(newton.GeoType.CYLINDER): "mjGEOM_CYLINDER",
    int(newton.GeoType.BOX): "mjGEOM_BOX",
}


def write_mujoco(path: Path, mechanism: Mechanism) -> None:
    """Write a mechanism as MJCF.

    The control of a motor is the tension [N] at its tendon. Spool, servo and effects stay behind:
    what they do is a program's business in MuJoCo. A file that is there is replaced.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    names = names_of(mechanism)
    spec = scene_spec(mechanism, names)
    for tendon in mechanism.tendons:
        add_motor(spec, names[tendon.prim], tendon.force_limit, direct=tendon.direct)
    write_spec(path, spec)


def named_apart(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism whose joints and tendons are called as MJCF calls them.

    Raises:
        InvalidAsset: Two joints or tendons would have the same name.
    """
    names = names_of(mechanism)
    return replace(
        mechanism,
        joints=tuple(replace(joint, name=names[joint.prim]) for joint in mechanism.joints),
        tendons=tuple(replace(tendon, name=names[tendon.prim]) for tendon in mechanism.tendons),
    )


def mujoco_spec(mechanism: Mechanism) -> Any:
    """Return a mechanism, with its own numbers, as MuJoCo's editable model without actuators.

    Joints and tendons have the names that `named_apart` gives them.

    Raises:
        InvalidAsset: Two joints or tendons would have the same name.
        InvalidParameter: An obstacle has a mass.
    """
    mechanism.refuse_moving_obstacle("an MJCF file with a servo")
    return scene_spec(mechanism, names_of(mechanism))


def scene_spec(mechanism: Mechanism, names: Mapping[str, str]) -> Any:
    """Return a mechanism and its obstacles, which may move, as MuJoCo's editable model.

    Prims have the names of `names_of`.
    """
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        draft = Path(folder) / "export.xml"
        alone = replace(mechanism, obstacles=())
        model = build_model(alone, 1, overrides=[BenchOverrides()], device="cpu")
        # its own kernels would compile for half a minute, and nothing is stepped
        solver: Any = SolverMuJoCo(
            model, disable_contacts=True, use_mujoco_cpu=True, save_to_mjcf=str(draft)
        )
        text = short_names(draft.read_text(encoding="utf-8"), mechanism, names)
    mujoco = newton_s_mujoco()
    spec = mujoco.MjSpec.from_string(text)
    spec.modelname = mechanism.name
    spec.option.timestep = TIME_STEP
    for joint, stop in zip(spec.joints, solver.mj_model.jnt_solref, strict=True):
        joint.solref_limit = stop  # the export leaves the end stops at MuJoCo's default
    add_obstacles(spec, mechanism, draw_shapes(spec, mechanism, names), mujoco)
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


def named_prims(mechanism: Mechanism) -> list[str]:
    """Return the paths of joints and tendons, which programs call by name."""
    return [*mechanism.template.joint_label, *(tendon.prim for tendon in mechanism.tendons)]


def names_of(mechanism: Mechanism) -> dict[str, str]:
    """Return what MJCF calls each prim, by its path.

    Raises:
        InvalidAsset: Two joints or tendons would have the same name.
    """
    template, prims = mechanism.template, named_prims(mechanism)
    shared = len({last(prim) for prim in prims}) < len(prims)
    called = of_its_finger if shared else last
    names = [called(prim) for prim in prims]
    if len(set(names)) < len(names):
        raise InvalidAsset(
            f"MJCF calls joints and tendons by their finger and name; {mechanism.name} has some "
            "twice: each finger of a hand must stand directly below its root"
        )
    unique = {**dict(zip(prims, names, strict=True)), **told_apart(template.body_label, called)}
    return told_apart(template.shape_label, called) | unique


def told_apart(prims: Sequence[str], called: Callable[[str], str]) -> dict[str, str]:
    """Return names of prims: those that share one have as many parts of their paths as differ."""
    names = {prim: called(prim) for prim in prims}
    for parts in range(2, 1 + max((prim.count("/") for prim in prims), default=0)):
        count = Counter(names.values())
        for prim in (prim for prim, name in names.items() if count[name] > 1):
            names[prim] = "_".join(prim.strip("/").split("/")[-parts:])
    return names


def short_names(text: str, mechanism: Mechanism, names: Mapping[str, str]) -> str:
    """Call prims by their names in place of their paths."""
    template = mechanism.template
    prims = [*template.body_label, *template.joint_label]
    for prim in sorted(prims, key=len, reverse=True):
        text = text.replace(f'"{prim.replace("/", "_")}"', f'"{names[prim]}"')
    for tendon in mechanism.tendons:
        text = text.replace(f'"{tendon.prim}"', f'"{names[tendon.prim]}"')
    for shape, label in enumerate(template.shape_label):
        text = text.replace(f'"{label}_{shape}"', f'"{names[label]}"')
    return text


def of_its_finger(prim: str) -> str:
    """Return the last part of a prim's path behind its finger's name."""
    _, _, *parts = prim.split("/")
    return "_".join(dict.fromkeys((parts[0], parts[-1])))


def last(prim: str) -> str:
    """Return the last part of a prim's path."""
    return prim.rsplit("/", maxsplit=1)[-1]


def draw_shapes(spec: Any, mechanism: Mechanism, names: Mapping[str, str]) -> list[Any]:
    """Add the asset's shapes to be looked at; return the geoms of the capsules of its links.

    The shapes neither weigh nor touch: an obstacle's contacts name what it meets.
    """
    kinds = newton_s_mujoco().mjtGeom
    template = mechanism.template
    bones: list[Any] = []
    for shape, kind in enumerate(template.shape_type):
        flags = template.shape_flags[shape]
        hidden = bool(flags & newton.ShapeFlags.SITE) or not flags & newton.ShapeFlags.VISIBLE
        if hidden or int(kind) not in DRAWN:
            continue
        owner = template.shape_body[shape]
        link = "" if owner < 0 else names[template.body_label[owner]]
        body = spec.body(link) if link else spec.worldbody
        place = np.array(template.shape_transform[shape], dtype=np.float64)
        geom = body.add_geom(
            type=getattr(kinds, DRAWN[int(kind)]),
            size=np.array(template.shape_scale[shape], dtype=np.float64),
            pos=place[:3],
            quat=place[[6, 3, 4, 5]],
            contype=0,
            conaffinity=0,
            mass=0.0,
            rgba=[0.86, 0.66, 0.49, 1.0],
        )
        if link and kind == newton.GeoType.CAPSULE:
            geom.name = f"{link}_{last(template.shape_label[shape])}"
            bones.append(geom)
    return bones


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

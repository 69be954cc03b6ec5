"""A corrected mechanism as a layer of USD: the same numbers, for every program."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.effects import EFFECTS
from tendon_newton.mechanisms.asset_library import asset_names
from tendon_newton.mechanisms.authoring.corrected_layer import (
    NUMBERS,
    Numbers,
    write_corrected_layer,
)
from tendon_newton.mechanisms.authoring.correction import HOMES, correct
from tendon_newton.mechanisms.checks import check_asset
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tests.made import stated_model
from tests.physics.runs import ideal_model, run_of, simulate, stairs

FLOAT32 = 1e-6  # relative: USD's physics and Newton's arrays are float32
FOUND: dict[str, dict[str, float]] = {
    "joint_stiffness_error": {"scale": 1.3},
    "joint_damping_error": {"scale": 2.0},
    "joint_dry_friction": {"fraction": 0.1},
    "gravity_misalignment": {"angle": 0.2},
    "spool_radius_error": {"scale": 1.1},
    "position_offset": {"angle": 0.1},
    "force_saturation": {"limit": 12.0},
}
"""A value for each effect that is but another number of a mechanism."""
SLIDERS = ("spring_weak", "spring_strong")
OVERRIDES = BenchOverrides(mass=(0.013, 0.009), range=(1.6, 1.3), moment_arm=(0.009, 0.006))


def model_of(*names: str, overrides: BenchOverrides | None = None) -> Model:
    """Return the ideal source with some of the found effects."""
    return stated_model(
        "ideal",
        {"gain": 4.2, "spool_radius": 0.0125},
        {n: FOUND[n] for n in names},
        bench_overrides={} if overrides is None else {"finger": overrides},
    )


def written(folder: Path, model: Model, numbers: Numbers | None = None) -> Mechanism:
    """Write the layer of the finger for a model, and load it."""
    path = folder / "corrected.usda"
    correction = correct(load_mechanism("finger"), model)
    write_corrected_layer(path, correction, numbers or {})
    return load_mechanism(path)


def numbers_of(mechanism: Mechanism) -> dict[str, Any]:
    """Return every number of a mechanism by name."""
    table: dict[str, Any] = {"gravity": mechanism.gravity}
    for joint in mechanism.joints:
        for key in (
            "stiffness", "damping", "friction", "mass", "limits", "inertia", "rest",
            "center_of_mass", "parent_position",
        ):  # fmt: skip
            table[f"{joint.name}.{key}"] = getattr(joint, key)
    for tendon in mechanism.tendons:
        for key in ("moment_arm", "spool_radius", "force_limit", "excursion_offset"):
            table[f"{tendon.name}.{key}"] = getattr(tendon, key)
        for k, span in enumerate(tendon.route.spans if tendon.route else ()):
            for key in ("start", "end", "pulley"):
                if (stop := getattr(span, key)) is not None:
                    table[f"{tendon.name}.{k}.{key}"] = stop.point
    if mechanism.tip is not None:
        table["tip"] = mechanism.tip.point
    return table


def test_the_layer_loads_to_the_corrected_numbers(tmp_path: Path) -> None:
    """All effects and bench numbers at once; what was not found stays the asset's."""
    assert set(FOUND) == set(HOMES)
    model = model_of(*FOUND, overrides=OVERRIDES)
    expected = numbers_of(correct(load_mechanism("finger"), model).corrected)
    found = numbers_of(written(tmp_path, model))
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=FLOAT32, abs=1e-12), name


@pytest.mark.parametrize("bench", [name for name in asset_names() if name not in SLIDERS])
def test_longer_and_heavier_links_stand_in_the_layer(bench: str, tmp_path: Path) -> None:
    """Centre, inertia, joints, sites and tip of each link keep their share of its length."""
    from pxr import Usd, UsdGeom

    asset = load_mechanism(bench)
    count = len(asset.joints)
    changes: dict[str, Any] = {"arm_mass": (0.003,) * count}
    if all(joint.length is not None for joint in asset.joints):
        changes["length"] = tuple(1.1 * joint.length for joint in asset.joints)
    own = BenchOverrides(mass=tuple(1.2 * joint.mass for joint in asset.joints), **changes)
    correction = correct(asset, replace(model_of(), bench_overrides={bench: own}))
    path = tmp_path / "corrected.usda"
    write_corrected_layer(path, correction, {})
    expected, found = numbers_of(correction.corrected), numbers_of(load_mechanism(path))
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=FLOAT32, abs=1e-9), name
    stage = Usd.Stage.Open(str(path))
    cache = UsdGeom.XformCache()
    for joint in correction.corrected.joints:  # links stand where joints have them
        prim = stage.GetPrimAtPath(joint.prim)
        ends = []
        for side in "01":
            (body,) = prim.GetRelationship(f"physics:body{side}").GetTargets() or [None]
            place = prim.GetAttribute(f"physics:localPos{side}").Get()
            frame = cache.GetLocalToWorldTransform(stage.GetPrimAtPath(body)) if body else None
            ends.append(place if frame is None else frame.Transform(place))
        assert ends[0] == pytest.approx(ends[1], abs=1e-7), joint.name


def test_the_layer_moves_as_the_effects_do(tmp_path: Path) -> None:
    """The effects on the asset as it was, and the layer without them, are one motion."""
    found = {name: values for name, values in FOUND.items() if name != "force_saturation"}
    run = run_of(stairs(np.random.default_rng(0), 80, 0.5, 2.5, 20))
    layer = written(tmp_path, model_of(*found))
    # the radius that a model names counts, whatever the asset's is
    radius = layer.tendons[0].spool_radius
    plain = stated_model("ideal", {"gain": 4.2, "spool_radius": radius})
    (before,) = simulate([run], ideal_model(), time_step=1e-3)
    (effect,) = simulate([run], ideal_model(**found), time_step=1e-3)
    (after,) = simulate([run], plain, time_step=1e-3, mechanism=layer)
    moved = np.ptp(before.joint_position, axis=0)
    assert np.max(np.abs(effect.joint_position - before.joint_position) / moved) > 1e-3
    # 1e-5 of the motion: the layer's numbers are float32
    assert np.max(np.abs(effect.joint_position - after.joint_position) / moved) < 1e-5


def test_the_layer_holds_overrides_and_nothing_else(tmp_path: Path) -> None:
    """Any USD program sees the corrected number; below the layer the asset is as it was."""
    from pxr import Sdf, Usd

    written(tmp_path, model_of("joint_stiffness_error"))
    stage = Usd.Stage.Open(str(tmp_path / "corrected.usda"))
    spring = stage.GetPrimAtPath("/finger/joints/pip").GetAttribute("mjc:stiffness")
    assert spring.Get() == pytest.approx(1.3 * 0.045)
    layer = stage.GetRootLayer()
    assert Path(layer.ComputeAbsolutePath(layer.subLayerPaths[0])).samefile(
        load_mechanism("finger").asset
    )
    specs = []
    layer.Traverse("/", lambda path: specs.append(layer.GetObjectAtPath(path)))
    prims = [spec for spec in specs if isinstance(spec, Sdf.PrimSpec)]
    assert {prim.specifier for prim in prims} == {Sdf.SpecifierOver}
    attributes = [spec.name for spec in specs if isinstance(spec, Sdf.AttributeSpec)]
    assert attributes == ["mjc:stiffness", "mjc:stiffness"]
    assert not [f for f in check_asset(tmp_path / "corrected.usda") if f.severity == "error"]


def test_what_has_no_place_in_usd_stands_beside_it(tmp_path: Path) -> None:
    """A delay is no attribute of any prim; its number is kept all the same."""
    from pxr import Sdf

    model = stated_model(
        "ideal",
        {"gain": 4.2, "spool_radius": 0.0125},
        {"command_delay": {"delay": 0.04}, "joint_damping_error": {"scale": 2.0}},
    )
    numbers = {
        "command_delay": {"delay": (0.04, "s")},
        "joint_damping_error": {"scale": (2.0, "1")},
    }
    written(tmp_path, model, numbers)
    text = (tmp_path / "corrected.usda").read_text(encoding="utf-8")
    assert "delay" not in text[text.index('over "finger"') :]
    kept = Sdf.Layer.FindOrOpen(str(tmp_path / "corrected.usda")).customLayerData[NUMBERS]
    assert kept["not_in_usd"] == {"command_delay": {"delay": {"value": 0.04, "unit": "s"}}}
    assert kept["in_this_layer"]["joint_damping_error"]["scale"]["value"] == 2.0


def test_every_effect_has_a_place_or_is_left() -> None:
    """A model of the whole catalogue loses none."""
    effects = tuple(
        NamedValues(name=name, values={p.name: p.nominal for p in effect.parameters})
        for name, effect in EFFECTS.items()
    )
    actuator = NamedValues(name="ideal", values={"gain": 4.2, "spool_radius": 0.0125})
    correction = correct(load_mechanism("finger"), Model(actuator=actuator, effects=effects))
    assert set(correction.applied) | set(correction.left) == set(EFFECTS)
    assert set(correction.applied) == set(HOMES)

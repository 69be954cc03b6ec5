"""A corrected bench as USD."""

from dataclasses import replace
from pathlib import Path

import newton
import pytest
from newton.usd import SchemaResolverMjc, SchemaResolverNewton, SchemaResolverPhysx

from tendon_newton.exports.usd_target import BENCH_FILE, WAY, write_usd_target
from tendon_newton.mechanisms.authoring.correction import correct
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.replay import bench_of
from tests.exports.models import ANGLE, FORCE, model_of, strays


def test_the_file_holds_what_a_bench_can_hold(tmp_path: Path) -> None:
    """Springs are 1.2 times as stiff in it; the servo's delay stands in the list."""
    model = model_of("finger", "ideal", "joint_stiffness_error", "command_delay")
    exported = write_usd_target(tmp_path, bench_of("finger", model), model)
    before, after = load_mechanism("finger"), load_mechanism(tmp_path / BENCH_FILE)
    for old, new in zip(before.joints, after.joints, strict=True):
        assert new.stiffness == pytest.approx(1.2 * old.stiffness, rel=1e-6)  # float32
    assert exported.left_out == {"other programs": ("command_delay",)}


@pytest.mark.parametrize(
    "others", [(SchemaResolverPhysx,), (SchemaResolverPhysx, SchemaResolverMjc)]
)
def test_friction_comes_through_the_readers_of_isaac(others, tmp_path: Path) -> None:
    """Newton reads a file with PhysX's schemas beside its own in Isaac: no number changes."""
    effects = ("joint_dry_friction", "joint_damping_error")
    model = model_of("finger", "ideal", *effects)
    mechanism = bench_of("finger", model)
    write_usd_target(tmp_path, mechanism, model)
    meant = correct(mechanism, replace(model, bench_overrides={})).corrected
    builder = newton.ModelBuilder()
    readers = [SchemaResolverNewton(), *(other() for other in others)]
    builder.add_usd(str(tmp_path / BENCH_FILE), schema_resolvers=readers)
    assert builder.joint_friction == pytest.approx([j.friction for j in meant.joints], rel=1e-6)
    assert builder.joint_damping == pytest.approx([j.damping for j in meant.joints], rel=1e-6)
    assert min(builder.joint_friction) > 0.0


def test_the_file_stands_alone(tmp_path: Path) -> None:
    """It names no other file."""
    model = model_of("thumb", "ideal", "joint_damping_error")
    write_usd_target(tmp_path, bench_of("thumb", model), model)
    text = (tmp_path / BENCH_FILE).read_text(encoding="utf-8")
    assert "subLayers" not in text
    assert "@" not in text


def test_our_solver_on_the_file_is_our_solver(tmp_path: Path) -> None:
    """With the rest of the model it moves as the asset does with all of it."""
    effects = ("joint_stiffness_error", "gravity_misalignment", "spool_radius_error")
    found = strays(tmp_path, "usd", WAY, "finger", "ideal", *effects)
    assert found.angle < 0.1 * ANGLE
    assert found.force < 0.1 * FORCE

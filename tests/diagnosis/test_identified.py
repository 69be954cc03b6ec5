"""``identified.usda``, as `tendon-newton diagnose` writes it."""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from tendon_newton.cli import main
from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.diagnosis.identified import write_identified
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.mechanisms.authoring.identified_layer import PROVENANCE
from tendon_newton.mechanisms.loading import load_mechanism
from tests.diagnosis.made_up import EXAMPLE, diagnosis, named


def found() -> Diagnosis:
    """Return a diagnosis of a stiff spring behind a late servo."""
    causes = (named("joint_stiffness_error", 1.25), named("command_delay", 0.04))
    effects = tuple(
        NamedValues(name=c.name, values={n: p.value for n, p in c.parameters.items()})
        for c in causes
    )
    made = diagnosis("explained")
    actuator = NamedValues(name="ideal", values={"gain": 4.2, "spool_radius": 0.0125})
    return replace(made, effects=causes, model=Model(actuator=actuator, effects=effects))


def provenance(path: Path) -> dict:
    """Return what a layer says of itself."""
    from pxr import Sdf

    return Sdf.Layer.FindOrOpen(str(path)).customLayerData[PROVENANCE]


def test_every_bench_gets_its_layer_with_the_interval(tmp_path: Path) -> None:
    """The example has three benches; each spring is the found one, and says how sure it is."""
    files = write_identified(tmp_path, found(), load_dataset(EXAMPLE))
    names = ["finger", "spring_strong", "spring_weak"]
    assert sorted(path.name for path in files) == [f"identified_{name}.usda" for name in names]
    for name in names:
        path = tmp_path / f"identified_{name}.usda"
        for own, asset in zip(
            load_mechanism(path).joints, load_mechanism(name).joints, strict=True
        ):
            assert own.stiffness == pytest.approx(1.25 * asset.stiffness)
            assert own.damping == asset.damping
        kept = provenance(path)
        scale = kept["in_this_layer"]["joint_stiffness_error"]["scale"]
        assert (scale["value"], scale["unit"], list(scale["ci95"])) == (1.25, "1", [1.25, 1.25])
        assert set(kept["not_in_usd"]) == {"command_delay"}
        assert kept["dataset_sha256"] == load_dataset(EXAMPLE).sha256


def test_what_a_layer_cannot_hold_of_a_bench_is_said(tmp_path: Path) -> None:
    """A longer link stands beside the servo's numbers; its mass is in the layer."""
    made = found()
    longer = BenchOverrides(length=(0.031, 0.024), mass=(0.013, 0.009))
    model = replace(made.model, bench_overrides={"finger": longer})
    write_identified(tmp_path, replace(made, model=model), load_dataset(EXAMPLE))
    kept = provenance(tmp_path / "identified_finger.usda")["not_in_usd"]
    assert {name: n["value"] for name, n in kept["length"].items()} == {"pip": 0.031, "dip": 0.024}
    joints = load_mechanism(tmp_path / "identified_finger.usda").joints
    assert [joint.mass for joint in joints] == pytest.approx([0.013, 0.009])
    assert "length" not in provenance(tmp_path / "identified_spring_weak.usda")["not_in_usd"]


def test_one_bench_gets_one_file_of_the_plain_name(tmp_path: Path) -> None:
    """And a layer without overrides where the mechanism is what the asset says."""
    whole = load_dataset(EXAMPLE)
    alone = replace(
        whole, train=tuple(r for r in whole.train if r.bench == "finger"), test=whole.test[:0]
    )
    (path,) = write_identified(tmp_path, diagnosis("no_gap"), alone)
    assert path == tmp_path / "identified.usda"
    assert "over" not in path.read_text(encoding="utf-8").split('"""')[2]


def test_the_hash_is_that_of_every_file(tmp_path: Path) -> None:
    """One digit of one recording changes it."""
    copy = tmp_path / "copy"
    shutil.copytree(EXAMPLE, copy)
    assert load_dataset(copy).sha256 == load_dataset(EXAMPLE).sha256
    file = copy / load_dataset(copy).test[0].name
    text = file.read_text(encoding="utf-8")
    file.write_text(f"{text.rstrip()[:-1]}7\n", encoding="utf-8")
    assert load_dataset(copy).sha256 != load_dataset(EXAMPLE).sha256


@pytest.mark.parametrize(
    ("share", "message"),
    [("0.99", "--hold-out must be 0.05 to 0.8; it is 0.99"), ("0.3", "has 3 with split")],
)
def test_a_hold_out_that_makes_no_sense_is_refused(share, message, tmp_path, capsys) -> None:
    """A share beyond reason, and a dataset that holds recordings out already."""
    model = str(EXAMPLE / "model.toml")
    words = ["diagnose", str(EXAMPLE), "--model", model, "--out", str(tmp_path)]
    assert main([*words, "--hold-out", share]) == 2
    assert message in capsys.readouterr().err

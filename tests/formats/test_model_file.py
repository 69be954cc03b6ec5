"""What a model file keeps."""

import copy
import pickle
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.model_file import Model, NamedValues, load_model, write_model
from tendon_newton.errors import InvalidModelFile
from tests.made import stated_model

names = st.from_regex(r"[a-z][a-z_]{0,12}", fullmatch=True).filter(
    lambda name: name not in ("name", "kind", "servo")
)
numbers = st.floats(allow_nan=False, allow_infinity=False)
values = st.dictionaries(names, numbers, max_size=4)


@given(
    kind=names,
    actuator=values,
    effects=st.dictionaries(names, values, max_size=3),
    fit=st.lists(names, unique=True, max_size=3),
    masses=st.dictionaries(names, st.floats(1e-6, 10.0), max_size=2),
    tolerances=st.dictionaries(names, st.just(0.0) | st.floats(1e-6, 1.0), max_size=2),
)
def test_a_model_file_keeps_every_bit(
    tmp_path_factory, kind, actuator, effects, fit, masses, tolerances
) -> None:
    """Written and read again, names, order and every float64 are the same."""
    model = stated_model(
        kind,
        actuator,
        effects,
        bench_overrides={bench: BenchOverrides(mass=(mass,)) for bench, mass in masses.items()},
        fit=tuple(fit),
        tolerances=tolerances,
    )
    path = tmp_path_factory.mktemp("toml") / "model.toml"
    write_model(path, model)
    assert load_model(path) == model


def test_a_model_travels_to_another_process_as_it_is() -> None:
    """Jobs are pickled: its read-only tables were refused, and the jobs waited for ever."""
    model = stated_model(
        "ideal",
        {"gain": 4.2},
        {"coulomb_friction": {"force": 0.8}},
        tolerances={"load_cell_gain": 0.02},
    )
    for again in (pickle.loads(pickle.dumps(model)), copy.deepcopy(model)):
        assert again == model
        with pytest.raises(TypeError):
            again.tolerances["load_cell_gain"] = 1.0


def test_a_file_name_is_a_legal_value(tmp_path: Path) -> None:
    """The learned actuator names its network's file."""
    path = tmp_path / "model.toml"
    path.write_text('[actuator]\nkind = "learned"\nfile = "force.pt"\nspool_radius = 0.0125\n')
    assert load_model(path).actuator.values["file"] == "force.pt"


def test_every_reference_model_loads(shared: Path) -> None:
    """All model files of the reference folder are read."""
    for path in sorted((shared / "challenges").glob("*/model.toml")):
        assert load_model(path).actuator.name == "ideal"


def test_an_effect_may_be_of_one_servo(tmp_path: Path) -> None:
    """Beside that of all servos and that of another; the key is absent where it is of all."""
    path = tmp_path / "model.toml"
    effects = tuple(
        NamedValues(name="gain_error", servo=servo, values={"scale": 0.8}) for servo in (None, 0, 1)
    )
    model = Model(actuator=NamedValues(name="ideal", values={"gain": 4.2}), effects=effects)
    write_model(path, model)
    assert load_model(path) == model
    assert path.read_text(encoding="utf-8").count("servo = ") == 2
    assert [effect.cause for effect in model.effects] == [
        "gain_error", "gain_error of servo 0", "gain_error of servo 1",
    ]  # fmt: skip


@pytest.mark.parametrize("servo", ["-1", "1.5", "true", '"flexor"'])
def test_a_servo_is_a_number_from_zero_on(servo: str, tmp_path: Path) -> None:
    """Anything else is refused with what is asked."""
    path = tmp_path / "model.toml"
    path.write_text(
        '[actuator]\nkind = "ideal"\n[[effects]]\nname = "gain_error"\nscale = 0.8\n'
        f"servo = {servo}\n"
    )
    with pytest.raises(InvalidModelFile, match="servo must be the number of a servo"):
        load_model(path)


def test_an_effect_of_one_servo_stands_once() -> None:
    """Twice is refused by its whole name."""
    twice = NamedValues(name="gain_error", servo=1, values={"scale": 0.8})
    with pytest.raises(InvalidModelFile, match="'gain_error of servo 1' is there 2 times"):
        Model(actuator=NamedValues(name="ideal", values={}), effects=(twice, twice))

"""The page on model files is what the program's tables say, and its examples are model files."""

import importlib.util
import re
from pathlib import Path

import pytest

from tendon_newton.actuators import ACTUATORS
from tendon_newton.data.model_file import load_model
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import TendonNewtonError
from tendon_newton.simulation.model.parameter_table import ParameterTable

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_the_page_is_made_from_the_tables_of_today() -> None:
    """``python docs/make_model_file.py`` would write the same."""
    specification = importlib.util.spec_from_file_location("page", DOCS / "make_model_file.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    assert (DOCS / "model_file.md").read_text(encoding="utf-8") == module.page()


def test_the_page_names_every_kind_every_effect_and_every_key() -> None:
    """With the unit and the null value beside each key of an effect."""
    text = (DOCS / "model_file.md").read_text(encoding="utf-8")
    for name, declared in (*ACTUATORS.items(), *EFFECTS.items()):
        assert f"| `{name}` |" in text
        for parameter in declared.parameters:
            assert f"| `{parameter.name}` | {parameter.unit} |" in text


def test_the_examples_of_the_page_are_models(tmp_path: Path) -> None:
    """Each loads, and every number of it has a place and lies in its range."""
    text = (DOCS / "model_file.md").read_text(encoding="utf-8")
    examples = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    assert examples
    for example in examples:
        path = tmp_path / "model.toml"
        path.write_text(example, encoding="utf-8")
        model = load_model(path)
        effects = tuple(effect.name for effect in model.effects)
        vector = ParameterTable(actuator=model.actuator.name, effects=effects).vector(model)
        assert vector.size > len(model.actuator.values)
        path.write_text(example.replace("armature", "amature"), encoding="utf-8")
        misspelt = load_model(path)
        with pytest.raises(TendonNewtonError, match="did you mean 'armature'"):
            ParameterTable(actuator=model.actuator.name, effects=effects).vector(misspelt)

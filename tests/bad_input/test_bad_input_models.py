"""Broken model files through the command line: what reading refuses, and what building refuses."""

import importlib.util
import os

import pytest

from tests.bad_input.damage import Damage, refusal, replaced, swap, text
from tests.importers.logs import dataset, model

ACTUATOR = '[actuator]\nkind = "ideal"\ngain = 4.2\nspool_radius = 0.0125\n'


def with_effect(lines: str) -> Damage:
    """A model with an effect of these lines."""
    return text("model.toml", f"{ACTUATOR}[[effects]]\n{lines}\n")


def before(lines: str) -> Damage:
    """A model with these lines at its top."""
    return text("model.toml", f"{lines}\n{ACTUATOR}")


# what is done to a sound model -> what the line must say
CASES: dict[str, tuple[Damage, tuple[str, ...]]] = {
    "a pipe": (replaced("model.toml", os.mkfifo), ("it is a device or a pipe",)),
    "broken": (text("model.toml", "= 3"), ("model.toml: must be TOML",)),
    "unknown key of a model": (text("model.toml", "effect = []\n"), ("no key named 'effect'",)),
    "empty": (text("model.toml", ""),
        ("model.toml: actuator must be an object; it is missing", "Write [actuator]")),
    "an actuator that is a word": (text("model.toml", 'actuator = "ideal"\n'),
        ("actuator must be an object; it is 'ideal'. Write [actuator]",)),
    "an actuator without a kind": (text("model.toml", "[actuator]\ngain = 4.2\n"),
        ("model.toml: actuator: kind must be text; it is missing, there are gain",)),
    "a kind that is a number": (swap("model.toml", '"ideal"', "1"),
        ("actuator: kind must be text; it is 1",)),
    "an unknown kind": (swap("model.toml", '"ideal"', '"ideel"'),
        ("No actuator named 'ideel'", "did you mean 'ideal'?")),
    "no gain": (swap("model.toml", "gain = 4.2\n", ""), ("actuator 'ideal' needs gain [N/rad]",)),
    "a word for a gain": (swap("model.toml", "4.2", '"high"'),
        ("gain of actuator 'ideal' must be between", "it is 'high'")),
    "a list for a gain": (swap("model.toml", "4.2", "[4.2]"),
        ("actuator: gain must be a finite number; it is [4.2]",)),
    "a gain below zero": (swap("model.toml", "4.2", "-4.2"), ("must be between", "it is -4.2")),
    "a gain that is none": (swap("model.toml", "4.2", "nan"),
        ("actuator: gain must be a finite number; it is nan",)),
    "an unknown number": (swap("model.toml", "gain =", "gains ="),
        ("No parameter of actuator 'ideal' named 'gains'", "did you mean 'gain'?")),
    "a spool in millimetres": (swap("model.toml", "0.0125", "12.5"),
        ("spool_radius of actuator 'ideal' must be between 0.001 and 1 m", "12.5")),
    "an effect that is a word": (before('effects = ["backlash"]'),
        ("effects must be a list of objects; it is ['backlash']. Write [[effects]]",)),
    "an effect without a name": (with_effect("coefficient = 1.5"),
        ("effects[0]: name must be text; it is missing, there are coefficient",)),
    "an unknown effect": (with_effect('name = "viscous_fricton"'),
        ("No effect named 'viscous_fricton'", "did you mean 'viscous_friction'?")),
    "an effect without its number": (with_effect('name = "viscous_friction"'),
        ("viscous_friction", "coefficient")),
    "an unknown number of an effect": (with_effect('name = "viscous_friction"\nmu = 1.5'),
        ("No parameter of effect 'viscous_friction' named 'mu'; known: coefficient",)),
    "a number of an effect out of range":
        (with_effect('name = "viscous_friction"\ncoefficient = 1e9'),
        ("coefficient of effect 'viscous_friction' must be between", "1000000000")),
    "an effect twice":
        (with_effect('name = "gain_error"\nscale = 1.1\n[[effects]]\nname = "gain_error"'),
        ("every effect stands once; 'gain_error' is there 2 times",)),
    "a fit that is a word": (before('fit = "gain"'),
        ("fit must be a list of names; it is 'gain'",)),
    "a fit twice": (before('fit = ["gain", "gain"]'), ("'gain' is there 2 times",)),
    "benches as numbers": (before("bench_overrides = {finger = 3}"),
        ("bench_overrides: finger must be an object; it is 3", "It has numbers")),
}  # fmt: skip


@pytest.mark.skipif(importlib.util.find_spec("newton") is None, reason="the simulator builds it")
@pytest.mark.parametrize("case", CASES)
def test_a_broken_model_is_refused_by_the_simulator_in_one_line(case, tmp_path, capsys) -> None:
    """Whether reading or building finds the fault, the line says what was expected and came."""
    damage, said = CASES[case]
    path = model(dataset(tmp_path) / "model.toml")
    damage(tmp_path)
    out = str(tmp_path / "out")
    line = refusal(["simulate", str(tmp_path), "--model", str(path), "--out", out], capsys)
    assert [words for words in said if words not in line] == []
    assert len(line) < 1500

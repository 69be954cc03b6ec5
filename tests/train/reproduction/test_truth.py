"""What a diagnosis found against what the virtual bench contains."""

from __future__ import annotations

from dataclasses import replace

from tendon_newton.model_file import NamedValues
from train.reproduction.diagnosis_stage import truth_text
from train.reproduction.physical import starting_model

TRUTH = {
    "finger": {
        "stribeck_friction": {"coulomb_force": 1.2},
        "load_dependent_friction": {"coefficient": 0.24},
        "viscous_friction": {"coefficient": 12.0},
        "viscoelastic_spring": {"relaxation_time": 1.7},
    },
    "spring_weak": {
        "stribeck_friction": {"coulomb_force": 1.2},
        "load_dependent_friction": {"coefficient": 0.24},
        "viscous_friction": {"coefficient": 12.0},
    },
}


def test_every_effect_of_the_plant_is_found_or_missed() -> None:
    """A special case counts, a rival is told, what was missed is missed, what is wrong is wrong."""
    effects = (
        NamedValues(name="coulomb_friction", values={"force": 1.5}),
        NamedValues(name="backlash", values={"width": 0.1}),
    )
    model = replace(starting_model(), effects=effects)
    text = truth_text(model, TRUTH, {"load_dependent_friction": "coulomb_friction"})
    assert "| stribeck_friction | coulomb_force 1.2 | as coulomb_friction: force 1.5 |" in text
    assert "| coefficient 0.24 | not told from coulomb_friction |" in text
    assert "| viscous_friction | coefficient 12 | in the starting model |" in text
    assert "| viscoelastic_spring | finger: relaxation_time 1.7 | missed |" in text
    assert "Named and not in the plant: backlash." in text
    assert "torque_constant 1.43 (data sheet 1.43)" in text


def test_nothing_is_scored_without_a_plant() -> None:
    """Real benches have no key."""
    assert "not known" in truth_text(starting_model(), {}, {})

"""What a diagnosis found against what the virtual bench contains."""

from __future__ import annotations

from dataclasses import replace

from tendon_lab.reproduction.diagnosis_words import causes_text, truth_text
from tendon_lab.reproduction.physical import starting_model
from tendon_lab.reproduction.steps.diagnosis_stage import sources
from tendon_newton.data.model_file import NamedValues

TRUTH = {
    "finger": {
        "stribeck_friction": {"coulomb_force": 1.2},
        "load_dependent_friction": {"coefficient": 0.5},
        "viscous_friction": {"coefficient": 12.0},
        "viscoelastic_spring": {"relaxation_time": 1.7},
    },
    "spring_weak": {
        "stribeck_friction": {"coulomb_force": 1.2},
        "load_dependent_friction": {"coefficient": 0.5},
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
    assert "| coefficient 0.5 | not told from coulomb_friction |" in text
    assert "| viscous_friction | coefficient 12 | in the starting model |" in text
    assert "| viscoelastic_spring | finger: relaxation_time 1.7 | missed |" in text
    assert "Named and not in the plant: backlash." in text
    assert "torque_constant 1.43 (data sheet 1.43)" in text


def test_nothing_is_scored_without_a_plant() -> None:
    """Real benches have no key."""
    assert "not known" in truth_text(starting_model(), {}, {})


def test_causes_are_counted_over_benches() -> None:
    """A bench counts once, whichever pass named the cause; what is not in the plant is said."""
    found = [
        {
            "json": [
                {"verdict": "partly_explained", "effects": [{"name": name}]} for name in passes
            ],
            "rivals": rivals,
        }
        for passes, rivals in (
            (("coulomb_friction", "coulomb_friction"), {"stribeck_friction": "coulomb_friction"}),
            (("coulomb_friction", "backlash"), {}),
        )
    ]
    lines = causes_text(found, TRUTH).splitlines()
    assert lines[0] == "First verdict, by bench: 2 partly explained."
    assert lines[4:] == [
        "| coulomb_friction | 2 | 0 | yes |",
        "| backlash | 1 | 0 | no |",
        "| stribeck_friction | 0 | 1 | yes |",
    ]
    assert "| backlash | 1 | 0 | not known |" in causes_text(found, {})
    nothing = {"json": [{"verdict": "unexplained", "effects": []}], "rivals": {}}
    assert causes_text([nothing], TRUTH) == "First verdict, by bench: 1 unexplained."
    assert "On 1 nothing was named" in causes_text([*found, nothing], TRUTH)


def test_a_bench_without_causes_of_its_own_takes_the_usual_ones() -> None:
    """Units of one product; one diagnosis serves all, and without any each is its own."""
    found = [
        {"json": [{"effects": [{"name": name} for name in names]}]}
        for names in (
            (),
            ("backlash",),
            ("coulomb_friction", "deadband"),
            ("deadband", "coulomb_friction"),
            (),
        )
    ]
    assert sources(found, 5) == [2, 1, 2, 3, 2]
    assert sources(found[2:3], 3) == [0, 0, 0]
    assert sources([], 2) == [0, 0]
    assert sources([found[0], found[4]], 2) == [0, 1]

"""Faults of a hand's fingers are named with their owner; data come from a plant of its own."""

import pytest

from tests.planted.hand.bench import FINGER, HAND
from tests.planted.owners.checks import (
    check_agreement,
    check_answer,
    check_convergence,
    check_strings,
    effect,
)
from tests.planted.owners.plant import Faults
from tests.planted.owners.sets import FAULTS, SILENT, Recipe

KINDS = (
    ("gain_error", 1),
    ("joint_dry_friction", 3),
    (SILENT, None),
    *((name, place % 4) for place, name in enumerate(FAULTS)),
    *((name, None) for name, owner in HAND.kinds if owner is None and name != SILENT),
)


def test_strings_are_as_long_as_a_fingers() -> None:
    """Two derivations that share no code give the same excursions to 10 nm in every posture."""
    check_strings(FINGER, "finger_routed")


@pytest.mark.slow
def test_the_plant_converges_with_its_step() -> None:
    """With every fault at once, half the step moves angles by less than half an encoder's floor."""
    faults = Faults(
        coulomb=(0.4, 0.0, 0.2, 0.0),
        viscous=(0.2,),
        slack=(0.0, 0.002, 0.0, 0.0),
        delay=(0.02, 0.01, 0.0, 0.0),
        rubbing=(0.0, 0.0, 0.0, 0.25),
    )
    check_convergence(HAND, faults)


def test_plant_and_simulator_do_the_same_with_faults_of_one_finger() -> None:
    """Less than the sensors' floors apart in angle and force of each of the four servos."""
    electric = Faults(gain=(1.0, 0.7, 1.0, 1.0), delay=(0.03,), cell_bias=(0.0, 0.0, 0.0, 0.5))
    mechanical = Faults(
        viscous=(0.4, 0.0, 0.0, 0.0),
        slack=(0.0, 0.003, 0.0, 0.0),
        stiffness=(1.0, 1.0, 1.6, 1.0),
        damping=(2.0,),
    )
    planted = (
        (Faults(), ()),
        (
            electric,
            (
                effect("gain_error", 1, scale=0.7),
                effect("command_delay", None, delay=0.03),
                effect("load_cell_bias", 3, offset=0.5),
            ),
        ),
        (
            mechanical,
            (
                effect("viscous_friction", 0, coefficient=0.4),
                effect("tendon_slack", 1, length=0.003),
                effect("joint_stiffness_error", 2, scale=1.6),
                effect("joint_damping_error", None, scale=2.0),
            ),
        ),
    )
    check_agreement(HAND, planted)


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "servo"), dict.fromkeys(KINDS))
def test_a_fault_is_named_with_its_finger_and_no_other(fault, servo, tmp_path) -> None:
    """Or as that of all; with its number in the extended model too; a clean set is silent."""
    check_answer(tmp_path, Recipe(bench=HAND, fault=fault, servo=servo, seed=5))

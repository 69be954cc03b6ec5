"""A force network in the paper's sim-to-real experiment, on a bench of its own servo."""

from __future__ import annotations

from dataclasses import replace

from tendon_lab.force_scoring.ideal_baseline import PAPER_GAIN
from tendon_lab.reproduction.closed_loop import replayed
from tendon_lab.reproduction.physical import with_ideal
from tendon_lab.reproduction.steps.network_stage import learned_model
from tendon_lab.reproduction.steps.tip_stage import SINES
from tendon_lab.reproduction.unit import Unit
from tendon_newton.data.model_file import Model
from tendon_newton.mechanisms.asset_library import asset_folder

NETWORK = asset_folder() / "networks" / "transformer-simulation-paper-0.safetensors"
TIME_STEP = 5.0e-4  # s


def test_a_network_that_answers_to_the_shaft_moves_the_finger_as_its_bench_does(unit: Unit) -> None:
    """Tip error 80 % below the ideal source's; the paper has 41 %. Recorded 0.2 rad sinusoid.

    The same network, held for 50 ms as in the paper, is worse than the ideal source: it chatters.
    """
    recording = unit.find("finger", next(iter(SINES)))

    def tip_error(model: Model) -> float:
        return replayed([recording], model, time_step=TIME_STEP)[0].tip_error

    learned = learned_model(NETWORK)
    law = {"hold_stiffness": 0.0, "hold_damping": 0.0}
    held = replace(
        learned, actuator=replace(learned.actuator, values={**learned.actuator.values, **law})
    )
    ideal = tip_error(with_ideal(PAPER_GAIN))
    assert tip_error(learned) < 0.2 * ideal
    assert tip_error(held) > ideal

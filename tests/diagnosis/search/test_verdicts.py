"""What an answer says of its whole: a verdict, a name and a class each have their condition."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.findings import Findings
from tendon_newton.diagnosis.search.decide.account import explained_share
from tendon_newton.diagnosis.search.decide.find_causes import find_causes
from tendon_newton.effects import find_effect
from tendon_newton.identification.signals import Scales
from tendon_newton.identification.study import Study
from tendon_newton.simulation.hosts.replay import replay, simulated_recording
from tests.effect_bench import ROW, commanded
from tests.physics.runs import ideal_model

STEP = 1.0e-3  # [s]
COUNT = 1.0e-4  # [rad] of the encoder's noise
CATALOGUE = ("command_delay", "actuator_lag", "viscous_friction", "gain_error", "coulomb_friction")
NONE = {n: {p.name: p.null for p in find_effect(n).parameters} for n in CATALOGUE}
QUICK, SLOW = ((0.5, 0.1), (1.6, 0.2)), ((0.3, 0.05), (0.8, 0.1))
"""Frequencies of two sines of a first log, and by how much those of the next are higher [Hz]."""


def waves(number: int, paces: Sequence[tuple[float, float]]) -> Array:
    """Return three seconds of two sines [rad]."""
    time = ROW * np.arange(240)
    (low, less), (high, more) = paces
    slow = np.sin(2.0 * np.pi * (low + less * number) * time)
    return 2.5 + 1.2 * slow + 0.5 * np.sin(2.0 * np.pi * (high + more * number) * time + number)


def log(number: int, paces: Sequence[tuple[float, float]], **first: float) -> Recording:
    """Return what the encoder of a weak spring logs; an effect is given by its first number."""
    values = {n: {next(iter(NONE[n])): value} for n, value in first.items()}
    asked, model = commanded(waves(number, paces)), ideal_model(**{**NONE, **values})
    (out,) = replay([asked], model, time_step=STEP)
    found = simulated_recording(asked, out)
    noise = np.random.default_rng(number).normal(0.0, COUNT, found.motor_position.shape)
    angle = found.motor_position + noise
    return replace(found, name=f"log_{number}", force=None, motor_position=angle)


def found(logs: Sequence[Recording], *names: str) -> Findings:
    """Look for some causes in three logs."""
    model = ideal_model()
    study = Study(logs, model, CATALOGUE, time_step=STEP, in_segments=True)
    return find_causes(logs, study, model, names)


def test_what_recordings_contradict_is_neither_named_nor_no_gap() -> None:
    """Gains of 1.2, 1.1 and 1.0: one of 1.1 fits all by four prices better, and predicts none."""
    logs = [log(k, QUICK, gain_error=scale) for k, scale in enumerate((1.2, 1.1, 1.0))]
    answer = found(logs, "gain_error")
    assert (answer.verdict, answer.closest.effects) == ("unexplained", ())


def test_a_number_that_others_contradict_is_not_named_beside_one_that_is_right() -> None:
    """Delays of 20, 10 and 5 ms beside a gain in all: one of 10 ms is worth seven prices."""
    delays = enumerate((0.02, 0.01, 0.005))
    logs = [log(k, QUICK, gain_error=1.4, command_delay=delay) for k, delay in delays]
    assert found(logs, "gain_error", "command_delay").closest.effects == ("gain_error",)


def test_an_interval_holds_what_unnamed_causes_would_do() -> None:
    """A delay worth less than its price has no name, and moves the friction as far as it may be."""
    logs = [log(k, QUICK, viscous_friction=0.3) for k in range(2)]
    widths = []
    for names in (("viscous_friction",), ("viscous_friction", "command_delay")):
        answer = found(logs, *names)
        assert answer.closest.effects == ("viscous_friction",)
        ((low, high),) = answer.closest.intervals.values()
        widths.append(high - low)
    assert widths[1] > 1.2 * widths[0]


def test_what_little_is_left_is_told() -> None:
    """Dry friction is all but 6 ms of delay, which nobody may name: eight prices are left."""
    logs = [log(k, SLOW, coulomb_friction=0.8, command_delay=0.006) for k in range(3)]
    answer = found(logs, "coulomb_friction")
    assert (answer.verdict, answer.closest.effects) == ("partly_explained", ("coulomb_friction",))


@pytest.mark.parametrize(("scale", "verdict"), [(1.3, "unexplained"), (1.6, "partly_explained")])
def test_most_of_a_gap_must_be_explained_for_a_name(scale: float, verdict: str) -> None:
    """Beside a friction that nobody may name a gain takes 64 or 87 % of the squared error."""
    logs = [log(k, QUICK, viscous_friction=0.3, gain_error=scale) for k in range(3)]
    answer = found(logs, "gain_error")
    assert (answer.verdict, answer.final is None) == (verdict, verdict == "unexplained")
    assert answer.closest.effects == ("gain_error",)


def made_up_fit(scales: tuple[float, float]) -> Any:
    """A fit of which only its scales are asked for [rad, N]."""
    return SimpleNamespace(scales=scales)


def test_a_signal_with_hardly_a_gap_keeps_no_cause_from_its_name() -> None:
    """Two frictions at rest leave a force open: 0.19 N become 0.45 where 264 mrad become 5."""
    signals, floors = (("theta", None), ("force", None)), Scales(theta=1.1e-3, force=0.06)
    pool: Any = SimpleNamespace(
        worlds=SimpleNamespace(where=SimpleNamespace(signals=signals)), floors=floors
    )
    before, after = map(made_up_fit, ((0.264, 0.19), (0.005, 0.45)))
    assert explained_share(pool, before, after) > 0.99


def test_causes_that_the_noise_tells_apart_are_no_class() -> None:
    """A lag in place of 2 ms of delay is 0.4 mrad off, four times the noise: form hides it."""
    answer = found([log(k, SLOW, command_delay=0.002) for k in range(3)], *CATALOGUE[:2])
    assert answer.closest.effects == ("command_delay",)
    assert answer.classes["command_delay"] == ()

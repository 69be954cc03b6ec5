"""A slip, a skip, a knock and a dip are found with time and size, and nothing where nothing was."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tendon_newton.data.recording import Array, Mask, Recording
from tendon_newton.diagnosis.in_time.balance import lagged, turns
from tendon_newton.diagnosis.in_time.changes_report import event_sentence
from tendon_newton.diagnosis.in_time.log_events import CalmDay, calm_day, find_events, usual
from tendon_newton.identification.cutting import beginning
from tests.diagnosis.in_time.test_changes import FIRST, log_of
from tests.effect_bench import RADIUS
from tests.physics.runs import ideal_model

AT = 6.5  # Of the event [s]; in `log_of` the command has moved at 6 s
STEP = 0.08  # Of the path [rad]
LOOSE = ideal_model(coulomb_friction={"force": 0.6}, tendon_slack={"length": STEP * RADIUS})
"""The bench with a string that is longer by it."""


@cache
def calm() -> tuple[Recording, ...]:
    """Recordings in which nothing happens."""
    return tuple(replace(log_of(FIRST, seed), voltage=voltage(seed)) for seed in (1, 2, 3, 8, 9))


@cache
def nothing() -> CalmDay:
    """What the model leaves of them."""
    return calm_day(calm(), FIRST)


def voltage(seed: int) -> Array:
    """Return a supply of 9 V with the noise of a register."""
    return 9.0 + np.random.default_rng(seed).normal(0.0, 0.05, 960)


def later(recording: Recording) -> Mask:
    """Tell the rows of the event and after it, shape (T, 1)."""
    return (recording.time >= AT)[:, None]


def skipped() -> Recording:
    """A recording whose angle skips."""
    own = log_of(FIRST, 4)
    return replace(own, motor_position=own.motor_position + STEP * later(own))


def slipped() -> Recording:
    """A recording whose string slips: it is slack, and that of a looser one takes over."""
    own, other = log_of(FIRST, 4), log_of(LOOSE, 4)
    share = np.clip((own.time - AT) / 0.05, 0.0, 1.0)[:, None]
    assert own.force is not None
    position = (1.0 - share) * own.motor_position + share * other.motor_position
    force = np.where(share == 0.0, own.force, share * other.force)
    return replace(own, motor_position=position, force=force)


def knocked() -> Recording:
    """A recording in which 2 N less hold the finger for 0.25 s, where its motor is."""
    own = log_of(FIRST, 4)
    there = (later(own)[:, 0] & (own.time < AT + 0.25))[:, None]
    return replace(own, force=np.where(there, own.force - 2.0, own.force))


def dipped() -> Recording:
    """A recording in which the supply falls to 6 V for half a second."""
    own = log_of(FIRST, 4)
    there = later(own)[:, 0] & (own.time < AT + 0.5)
    return replace(own, voltage=np.where(there, 6.0, voltage(4)))


@pytest.mark.parametrize(
    ("recording", "kind", "size", "said"),
    [
        (skipped, "skip", STEP, "The angle skipped by 8"),
        (slipped, "slip", STEP * RADIUS, "The string slipped by "),
        (knocked, "knock", 2.0, "Something pushed with "),
        (dipped, "dip", 1.0 / 3.0, "The supply fell by 33 % at 6.50 s to 6.99 s in log_4."),
    ],
)
def test_an_event_is_found_with_its_time_and_size(recording, kind, size, said) -> None:
    """One event of the right kind: within four rows, its size within a tenth."""
    (event,) = find_events(nothing(), [recording()], FIRST)
    assert event.kind == kind
    assert event.start == pytest.approx(AT, abs=0.05)
    assert event.size == pytest.approx(size, rel=0.1)
    assert event_sentence(event).startswith(said)


def test_recordings_in_which_nothing_happens_are_silent() -> None:
    """Other commands, the same bench; also on another day, whose model has a longer string."""
    assert find_events(nothing(), [log_of(FIRST, 5), log_of(FIRST, 6)], FIRST) == ()
    assert find_events(nothing(), [log_of(LOOSE, 7)], LOOSE) == ()


def test_a_supply_that_never_moved_still_has_its_steps() -> None:
    """One step of a register of tenths of a volt is no dip."""
    steady = [replace(own, voltage=np.full(960, 9.0)) for own in calm()]
    blip = np.where(np.arange(960) == 500, 8.9, 9.0)
    assert find_events(calm_day(steady, FIRST), [replace(steady[0], voltage=blip)], FIRST) == ()


def test_a_beginning_is_as_lively_as_a_step_over_all_that_is_asked_for() -> None:
    """A bench that starts from rest jerks then; a ramp changes its pace nowhere else."""
    ramp = np.linspace(0.0, 2.0, 160)
    found = turns(np.arange(160) / 80.0, ramp)
    assert (found[0], found[-1]) == (2.0, 2.0)
    assert found[40:-40] == pytest.approx(0.0, abs=1e-12)


def test_a_command_that_rests_makes_the_jumps_of_the_calmest_rows() -> None:
    """On a calm day of sines hardly a row rests: the one that does says nothing of jumps."""
    jumps = np.where(np.arange(100) % 2 == 0, 0.0, 1e-3)
    found = usual([(jumps, np.linspace(0.0, 1.0, 100))])
    assert found.shares(np.array([1e-3]), np.array([0.0])) == pytest.approx([1.0])


def test_a_knock_that_empties_the_string_is_told_as_a_least_one() -> None:
    """More would leave it as empty; so would no more."""
    own = knocked()
    there = (own.time >= AT) & (own.time < AT + 0.25)
    assert own.force is not None
    empty = replace(own, force=np.where(there[:, None], 0.0, own.force))
    (event,) = find_events(nothing(), [empty], FIRST)
    assert (event.kind, event.at_least) == ("knock", True)
    assert event_sentence(event).startswith("Something pushed with at least ")


def test_what_springs_remember_follows_with_a_time_constant() -> None:
    """63 % of a step is there after one, as uneven as the rows may be."""
    time = np.array([0.0, 0.1, 0.5, 2.1])
    found = lagged(time, np.array([0.0, 1.0, 1.0, 1.0]), 2.0)
    assert found == pytest.approx([0.0, *(1.0 - np.exp(-time[1:] / 2.0))], abs=1e-12)


def test_without_a_load_cell_or_a_calm_day_nothing_is_told() -> None:
    """What a model leaves by itself is not known then."""
    blind = replace(knocked(), force=None)
    assert find_events(nothing(), [blind], FIRST) == ()
    assert find_events(calm_day(calm()[:1], FIRST), [skipped()], FIRST) == ()


def test_runs_too_short_to_hold_a_step_tell_nothing_of_steps() -> None:
    """Two calm runs of 3 s: no rise is the greatest there, so any would be an event."""
    short = [beginning(own, 3.0) for own in calm()]
    assert find_events(calm_day(short, FIRST), [log_of(FIRST, 5), slipped()], FIRST) == ()

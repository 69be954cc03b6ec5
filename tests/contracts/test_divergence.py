"""No effect diverges at any number inside its bounds, on any bench that one tendon drives."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from tendon_newton.data.parameters import Parameter
from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.search.search_worlds import FINER, SEARCH_STEP
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.bench_scale import bench_scale
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.rollout import Candidates, Rollout, Stepping
from tests.effect_bench import GAIN, commanded
from tests.made import stated_model

BENCHES = ("finger", "finger_routed", "thumb", "spring_weak", "spring_strong", "pendulum")
TWINS = ("finger_routed", "thumb", "spring_strong")  # Of the finger and of the weak spring
TIME_STEPS = (SEARCH_STEP, FINER * SEARCH_STEP)  # [s] Those of a diagnosis
IDEAL = stated_model("ideal", {"gain": GAIN})
FRICTIONS = (None, "coulomb_friction")  # What an effect is tried beside, at its typical strength
SHARES = {1: (0.0, 0.33, 0.67, 1.0), 2: (0.0, 0.5, 1.0), 3: (0.0, 1.0)}
"""Where between its bounds a number is tried, by how many an effect has."""
OVERSHOOT = 0.1
"""How far a joint ten times as heavy presses into its end stop, as a share of its range [1]."""
SWING, DAMPING = 1.2, 0.1
"""[rad], [N m s/rad] Greatest command and damping of a pendulum; the others are asked for 6 rad."""
FURTHEST = 1.0e3  # [rad] A shaft without stops goes round where a late servo drives it on
FASTEST = 1.0e3  # [rad/s] A slider's spring without damping turns half a spool by 600
STRONGEST = 250.0
"""[N] A gear that loses nine tenths of what drives it back holds ten times the servo's 21 N."""


def steps_into_both_stops(bench: str) -> Recording:
    """Ask for steps of every size, held 0.1 to 0.35 s."""
    rng = np.random.default_rng(5)
    levels = np.where(np.arange(14) % 2, rng.uniform(0.0, 2.0, 14), rng.uniform(1.5, 6.0, 14))
    holds = rng.integers(8, 28, 14)
    if not load_mechanism(bench).tendons[0].direct:
        return commanded(np.repeat(levels, holds), bench)
    return commanded(np.repeat(SWING * (levels / 3.0 - 1.0), holds), bench, damping=DAMPING)


def strengths(parameter: Parameter, shares: tuple[float, ...]) -> Array:
    """Return numbers from one bound to the other, evenly in ratio where both are positive."""
    share = np.array(shares)
    if parameter.lower > 0.0:
        return parameter.lower * (parameter.upper / parameter.lower) ** share
    return parameter.lower + share * (parameter.upper - parameter.lower)


def candidates(rollout: Rollout) -> Iterator[tuple[str, Array]]:
    """Return every effect at all of its strengths, alone and beside dry friction.

    What encoders on joints read moves nothing, and may lie beyond a joint's end stops.
    """
    owners = rollout.table.owners
    moving = [(n, e) for n, e in EFFECTS.items() if not e.further_signals()]
    for beside, (name, effect) in product(FRICTIONS, moving):
        vector = rollout.base_vectors(IDEAL)[0].copy()
        if beside is not None:
            (column,) = rollout.table.columns(beside)
            vector[column] = owners[column][1].nominal
        columns = rollout.table.columns(name)
        shares = SHARES[len(effect.parameters)]
        for values in product(*(strengths(owners[c][1], shares) for c in columns)):
            vector[list(columns)] = values
            yield f"{name} {[float(value) for value in values]} beside {beside}", vector.copy()


def runs_of(recording: Recording, time_step: float) -> Rollout:
    """Return the kernel of the whole catalogue, its ranges those of the bench."""
    mechanism = load_mechanism(recording.bench)
    rollout = Rollout(
        mechanism, [recording], IDEAL, candidates=Candidates(effects=tuple(EFFECTS)),
        stepping=Stepping(time_step=time_step),
    )  # fmt: skip
    scale = bench_scale([mechanism], [recording], IDEAL)
    rollout.table = replace(rollout.table, scale=scale)
    return rollout


def is_physical(out: dict[str, Array], limits: Array) -> Array:
    """Tell which candidates stay between their end stops, and within what a bench can bear."""
    lower, upper = np.where(np.isfinite(limits), limits, [-FURTHEST, FURTHEST]).T
    margin = OVERSHOOT * (upper - lower)
    joints = out["joints"]
    fine = ((joints >= lower - margin) & (joints <= upper + margin)).all(axis=2)
    fine &= (np.abs(out["rate"]) < FASTEST).all(axis=2)
    fine &= (np.abs(out["force"]) < STRONGEST).all(axis=2)
    return fine.all(axis=1)


@pytest.mark.parametrize(
    ("bench", "time_step"),
    [
        # a finer step is the easier one, and a twin differs in its numbers alone
        pytest.param(
            bench, step, marks=pytest.mark.slow if step < max(TIME_STEPS) or bench in TWINS else ()
        )
        for bench, step in product(BENCHES, TIME_STEPS)
    ],
)
def test_no_effect_diverges_inside_its_bounds(bench: str, time_step: float) -> None:
    """Not at the bounds themselves, nor beside dry friction."""
    rollout = runs_of(steps_into_both_stops(bench), time_step)
    labels, vectors = zip(*candidates(rollout), strict=True)
    out = rollout.run_rows(np.stack(vectors)[:, None])
    fine = is_physical(out, np.array(load_mechanism(bench).joint_limits))
    assert fine.all(), [label for label, good in zip(labels, fine, strict=True) if not good]

"""What is known of an arm before causes are looked for: how it stands, plain servos, its floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.arms.arm import Arm, ArmMotion
from tendon_newton.arms.arm_simulation import loaded, simulate_arm
from tendon_newton.arms.floor import find_floor
from tendon_newton.arms.placement import Placement, find_placement
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.diagnose import extended_model
from tendon_newton.diagnosis.search.fixed_set import fit_set_anew
from tendon_newton.diagnosis.search.plain_models import PLAIN_MODELS
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.study import Study, replacements
from tendon_newton.mechanisms.geometry.mechanism import Mechanism

PLAIN = PLAIN_MODELS["lag, delay, deadband and offset"]
"""Effects of a plain servo."""
TIMING = ("actuator_lag", "command_delay")
"""Those that servos of one kind on one bus have in common."""
OWN_TIMING = 0.9
"""Share of the squared error that a servo's own timing may leave of that of all servos' timing."""


@dataclass(frozen=True, kw_only=True)
class KnownArm:
    """An arm, and a model of each of its servos."""

    placement: Placement
    arm: Arm
    """As the placement has it, with its floor."""
    starts: tuple[Model, ...]
    """From which the causes of each servo are looked for, J; with its lag and delay."""
    plain: tuple[Model, ...]
    """Plain models of the servos, fitted, J."""

    def with_loads(self, motions: Sequence[ArmMotion]) -> tuple[tuple[Recording, ...], ...]:
        """Return the recordings of each servo with the load on it, J of as many as motions.

        The weight is that of the measured posture. What the floor does is that of an arm of plain
        servos, which is told the commands alone.
        """
        states = simulate_arm(self.arm, dict(enumerate(self.plain)), motions)
        loads = [
            self.arm.weight(motion.angles) + state.loads - self.arm.weight(state.angles)
            for motion, state in zip(motions, states, strict=True)
        ]
        return each_servo(motions, loads)


def know_arm(
    mechanism: Mechanism, motions: Sequence[ArmMotion], starts: Sequence[Model]
) -> KnownArm:
    """Find how an arm stands and what its tip rests on.

    Args:
        mechanism: The arm; its joints are those of the motions, in their order.
        motions: Training motions.
        starts: What is stated of each servo, J models.

    Raises:
        InvalidRecording: The motions are not this arm's.
    """
    placement = find_placement(mechanism, motions)
    arm = placement.arm
    told = [replaced(s, placement.compliance if f else None)
            for s, f in zip(starts, placement.flipped, strict=True)]  # fmt: skip
    recordings = each_servo(motions, [arm.weight(motion.angles) for motion in motions])
    plain = tuple(plain_servo(s, own) for s, own in zip(told, recordings, strict=True))
    arm = find_floor(arm, dict(enumerate(plain)), motions)
    known = KnownArm(placement=placement, arm=arm, starts=tuple(told), plain=plain)
    recordings = known.with_loads(motions)
    if arm.floor is not None:
        plain = tuple(plain_servo(s, own) for s, own in zip(told, recordings, strict=True))
    timing = common_timing(plain, motions)
    timed = [timed_servo(*of, timing) for of in zip(told, plain, recordings, strict=True)]
    starts, plain = zip(*timed, strict=True)
    return replace(known, starts=starts, plain=plain)


def timed_servo(
    start: Model, own: Model, recordings: Sequence[Recording], timing: Sequence[NamedValues]
) -> tuple[Model, Model]:
    """Return what a servo's causes are looked for from, and its plain model.

    It has the timing of all servos, unless one of its own leaves much less of what it did.

    Args:
        start: What is stated of the servo.
        own: Its plain model.
        recordings: What it did, under its loads.
        timing: Lag and delay of all servos.
    """
    common = replace(start, effects=(*start.effects, *timing))
    alike = plain_servo(common, recordings, tuple(e for e in PLAIN if e not in TIMING))
    if squared_error(own, recordings) > OWN_TIMING * squared_error(alike, recordings):
        return common, alike
    kept = tuple(effect for effect in own.effects if effect.name in TIMING)
    return replace(start, effects=(*start.effects, *kept)), own


def squared_error(model: Model, recordings: Sequence[Recording]) -> float:
    """Return a model's mean squared error in the rows that are trusted [rad2]."""
    residuals = Study(recordings, model, tuple(EFFECTS)).residuals(*replacements([{}]))
    return float(np.concatenate([r.theta[0, r.trusted] ** 2 for r in residuals]).mean())


def common_timing(plain: Sequence[Model], motions: Sequence[ArmMotion]) -> list[NamedValues]:
    """Return lag and delay of all servos: the medians of theirs, by how far each is told to go."""
    ways = [np.abs(np.diff(motion.commands, axis=0)).sum(axis=0) for motion in motions]
    counts = np.sum(ways, axis=0) / np.sum(ways)
    out = []
    for name in TIMING:
        (number,) = EFFECTS[name].parameters
        own = [{e.name: e.values for e in model.effects}.get(name, {}) for model in plain]
        values = np.array([float(numbers.get(number.name, number.null)) for numbers in own])
        order = np.argsort(values)
        place = int(np.searchsorted(np.cumsum(counts[order]), 0.5))
        if values[order[place]] != number.null:
            out.append(NamedValues(name=name, values={number.name: float(values[order[place]])}))
    return out


def each_servo(
    motions: Sequence[ArmMotion], loads: Sequence[Array]
) -> tuple[tuple[Recording, ...], ...]:
    """Return the recordings of each servo with its loads [N m], of shapes (T, J) by motion."""
    pairs = list(zip(motions, loads, strict=True))
    servos = range(len(motions[0].recordings))
    return tuple(tuple(loaded(m.recordings[j], load[:, j]) for m, load in pairs) for j in servos)


def replaced(model: Model, compliance: float | None) -> Model:
    """Return a model whose servo gives way to its load by an unknown compliance [rad/(N m)]."""
    if compliance is None:
        return model
    values = {**model.actuator.values, "compliance": compliance}
    return replace(
        model, actuator=replace(model.actuator, values=values), fit=(*model.fit, "compliance")
    )


def plain_servo(
    start: Model, recordings: Sequence[Recording], names: Sequence[str] = PLAIN
) -> Model:
    """Fit a plain model to a servo's recordings; one that gives way to its load has no offset.

    A servo that is told nothing shows nothing: it stays as stated.
    """
    if all(np.ptp(r.command) == 0.0 for r in recordings if r.command is not None):
        return start
    study = Study(recordings, start, tuple(EFFECTS))
    effects = [e for e in names if e != "position_offset" or "compliance" not in start.fit]
    worlds = SearchWorlds(study)
    found = fit_set_anew(worlds, start, effects)
    return extended_model(study, start, values_of(worlds, found.columns, found.place), effects)

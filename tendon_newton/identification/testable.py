"""Which causes some recordings can show at all, and what a reader must know of the others."""

from collections.abc import Sequence

import numpy as np

from tendon_newton.data.recording import Array, Recording
from tendon_newton.data.servo_names import name_of
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.noise_floor import NoiseFloor
from tendon_newton.identification.signals import compares_force
from tendon_newton.identification.study import Study

LEAST_SECONDS, LEAST_TURNS = 3.0, 2
"""Shortest training data of which a cause may be named [s], and times that a motor must turn back:
a friction and an offset look alike in one direction."""
MOVES = 10.0  # Noise floors of the encoder from which a change of the angle is a motion [1]


def testable_effects(study: Study) -> tuple[str, ...]:
    """Return the causes that could show: no sensor's without it, no string's on a shaft.

    What a model says exactly is no cause.

    Each of several servos may have its own causes, and all together those of no sensor.
    """
    has_cell = any(recording.force is not None for recording in study.recordings)
    has_string = any(not tendon.direct for m in study.mechanisms for tendon in m.tendons)
    compared = {name for own in study.compared for name in own}
    out: list[str] = []
    for name, effect in EFFECTS.items():
        unseen = effect.acts_on_cell_only() and not has_cell
        further = effect.further_signals()
        unseen = unseen or (further and compared.isdisjoint(further))
        if unseen or not study.shows(name) or (effect.needs_string and not has_string):
            continue
        if name in study.exact:
            continue
        is_own = study.servos > 1 and effect.is_of_servo(independent=study.independent)
        if not is_own or effect.side != "sensor" or name in study.known:
            out.append(name)
        if is_own:
            out += [name_of(name, servo) for servo in range(study.servos)]
    return tuple(out)


def stated_columns(study: Study) -> tuple[int, ...]:
    """Return the places of effects' numbers that drawings, data sheets or calibrations state."""
    if not study.tolerant or study.servos > 1:
        return ()
    columns = (c for name in testable_effects(study) for c in study.table.columns(name))
    return tuple(c for c in columns if study.parameter(c).tolerance > 0.0)


def too_little(recordings: Sequence[Recording], noise: NoiseFloor) -> str | None:
    """Say what training recordings have too little of for any name; None if they have enough.

    Args:
        recordings: Those that would decide.
        noise: Noise of their sensors.
    """
    seconds = sum(r.duration for r in recordings)
    reach = MOVES * noise.theta
    moved = max(float(np.ptp(r.motor_position, axis=0).max()) for r in recordings)
    turned = sum(turns(r.motor_position[:, d], reach)
                 for r in recordings for d in range(r.tendon_count))  # fmt: skip
    for is_too_little, came in (
        (seconds < LEAST_SECONDS, f"they last {seconds:.2g} s together; {LEAST_SECONDS:g} s are"),
        (moved < reach, f"the motor moves by {1e3 * moved:.2g} mrad; {1e3 * reach:.2g} mrad are"),
        (turned < LEAST_TURNS, f"the motor turns back {turned} times; {LEAST_TURNS} are"),
    ):
        if is_too_little:
            return f"The training recordings are too little for a name: {came} the least."
    return None


def turns(angle: Array, reach: float) -> int:
    """Return how often a motor turns back by more than a reach [rad]; angle of shape (T,)."""
    count, direction, extreme = 0, 0, angle[0]
    for value in angle:
        if direction * (value - extreme) > 0.0:
            extreme = value
        elif abs(value - extreme) > reach:
            count += direction != 0
            direction, extreme = (1 if value > extreme else -1), value
    return count


def untested_sides(study: Study) -> tuple[str, ...]:
    """Say which sides of the load cell the recordings cannot test, one sentence each."""
    recordings = study.recordings
    driven = [recording for recording in recordings if recording.driven_by == "force"]
    out = []
    if driven:
        out.append(
            f"{share(len(driven), len(recordings))} no theta_d: the measured force drives the "
            "mechanism, so what lies between command and load cell was not tested"
            + (" there." if len(driven) < len(recordings) else ".")
        )
    blind = [r for r in recordings if r.force is None]
    if blind:
        out.append(
            f"{share(len(blind), len(recordings))} no load cell: only the motor angle was "
            "compared, so causes that act on the force alone could not be tested"
            + (
                ", and actuator and mechanism cannot be looked at apart."
                if not any(compares_force(r) for r in recordings)
                else " there."
            )
        )
    return tuple(out)


def share(part: int, whole: int) -> str:
    """Return how many recordings have something, as the beginning of a sentence."""
    return "The recordings have" if part == whole else f"{part} of {whole} recordings have"

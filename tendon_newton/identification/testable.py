"""Which causes some recordings can show at all, and what a reader must know of the others."""

from __future__ import annotations

from tendon_newton.data.servo_names import name_of
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.study import Study, compares_force


def testable_effects(study: Study) -> tuple[str, ...]:
    """Return the causes that could show: no load cell's without one, no string's on a shaft.

    Of several servos each may have its own, and all of them together what is about no sensor.
    """
    has_cell = any(recording.force is not None for recording in study.recordings)
    has_string = any(not tendon.direct for m in study.mechanisms for tendon in m.tendons)
    out: list[str] = []
    for name, effect in EFFECTS.items():
        unseen = effect.acts_on_cell_only() and not has_cell
        if unseen or not study.shows(name) or (effect.needs_string and not has_string):
            continue
        is_own = study.servos > 1 and effect.is_of_servo(apart=study.apart)
        if not is_own or effect.side != "sensor" or name in study.known:
            out.append(name)
        if is_own:
            out += [name_of(name, servo) for servo in range(study.servos)]
    return tuple(out)


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

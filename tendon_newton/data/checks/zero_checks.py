"""Zeros of an angle: beside that of its command, or another one from some row on."""

from collections.abc import Iterator

import numpy as np

from tendon_newton.data.checks.command_checks import LIKE
from tendon_newton.data.checks.finding import Examined, Finding, Severity
from tendon_newton.data.checks.following import expected
from tendon_newton.data.checks.measures import names_of
from tendon_newton.data.checks.read_checks import LEAST_ROWS, unasked_jumps
from tendon_newton.data.checks.set_checks import OFF_ZERO
from tendon_newton.data.recording import Recording

SLIPPED = 0.1  # [rad] by which a zero must change
LASTING = 1.0  # [s] before and after which it must stay
STEADY = 0.25  # [1] of the change, within which the angle keeps to its command on either side
AS_FAR = (0.8, 1.25)  # [1] times as far as its command a servo goes that nothing holds back


def zeros(recording: Recording) -> Iterator[Finding]:
    """An angle whose zero changes amid a run, or lies far from that of its command."""
    if recording.command is None or recording.sample_count < LEAST_ROWS:
        return
    for place, column in enumerate(names_of(recording, "theta")):
        if told := changed_zero(recording, place) or far_zero(recording, place):
            yield Examined(recording.name, column).found(*told)


Told = tuple[Severity, str, str]
"""How bad it is, what was seen, and what to do."""


def changed_zero(recording: Recording, place: int) -> Told | None:
    """Say where an angle jumps and keeps to its command from another zero."""
    time = recording.time
    off, jumps = unasked_jumps(recording, place)
    edges = [0, *(int(row) + 1 for row in jumps), len(off)]
    for first, row, end in zip(edges, edges[1:], edges[2:], strict=False):
        before, after = off[first:row], off[row:end]
        change = float(np.median(after) - np.median(before))
        lasting = min(time[row - 1] - time[first], time[end - 1] - time[row])
        steady = max(float(np.std(before)), float(np.std(after))) < STEADY * abs(change)
        if abs(change) > SLIPPED and lasting > LASTING and steady:
            return (
                "defect",
                f"jumps by {change:+.3g} rad at row {row} and stays there, as theta_d does not",
                "its zero changed there: cut the file there, or take the jump off",
            )
    return None


def far_zero(recording: Recording, place: int) -> Told | None:
    """Say how far an angle stands beside its command all along, where nothing holds it back."""
    assert recording.command is not None
    if recording.bench != "servo" or recording.force is not None:
        return None
    theta, goal = recording.motor_position[:, place], expected(recording, place)
    zero = float(np.median(theta - recording.command[:, place]))
    spread, asked = float(np.std(theta)), float(np.std(goal))
    as_far = AS_FAR[0] * asked < spread < AS_FAR[1] * asked
    if abs(zero) < OFF_ZERO or not as_far or np.corrcoef(theta, goal)[0, 1] < LIKE:
        return None
    return (
        "caution",
        f"stands {zero:+.3g} rad beside theta_d all along",
        f"the zeros of theta and theta_d differ: say offset = {-zero:.3g} for theta in the "
        "mapping, or calibrate the joint anew",
    )

"""How large a bench is: what its forces and its travel are beside those of the nominal benches.

Effects declare ranges, typical values and starts for a finger or a spring that a servo of 21 N
pulls with a spool of 12.5 mm. On any other machine they follow from what its asset states and what
its recordings show.
"""

from collections.abc import Sequence
from itertools import groupby

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.data.parameters import BenchScale
from tendon_newton.data.recording import Recording
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.model.parameter_table import spool_radius_of
from tendon_newton.simulation.model.stated_size import range_of_tendon, scale_by, turns_a_shaft

NEARLY_ALL = 0.99  # Share of the rows that decides what recordings show; a few spikes must not
USED = (0.1, 1.25)
"""A limit or a range that an asset states counts where recordings use this share of it [1]. Where
they go beyond, it is not the machine's own; far below, it is a formality."""
SPARE = 3.0  # Otherwise a machine can do so many times what its recordings show [1]


def scale_of(
    benches: Sequence[Mechanism], recordings: Sequence[Recording], model: Model
) -> BenchScale:
    """Return the scale of a dataset: that of its largest bench, shafts only if all are.

    Args:
        benches: Mechanism of each recording, with all its numbers.
        recordings: What was measured there, of one servo each.
        model: Model whose actuator drives, for recordings without a force.
    """
    pairs = sorted(zip(benches, recordings, strict=True), key=lambda pair: pair[1].bench)
    own = [
        bench_scale([m for m, _ in group], [r for _, r in group], model)
        for group in (list(g) for _, g in groupby(pairs, key=lambda pair: pair[1].bench))
    ]
    return BenchScale(
        force=max(s.force for s in own),
        travel=max(s.travel for s in own),
        turn=max(s.turn for s in own),
        is_shaft=all(s.is_shaft for s in own),
        is_led=find_actuator(model.actuator.name).leads,
    )


def bench_scale(
    mechanisms: Sequence[Mechanism], recordings: Sequence[Recording], model: Model
) -> BenchScale:
    """Return the scale of one bench."""
    tendon = mechanisms[0].tendons[0]
    radius = spool_radius_of(model) or tendon.spool_radius
    forces = [greatest_force(r, model, radius, tendon.force_limit) for r in recordings]
    force = usable(tendon.force_limit, max(forces))
    moved = max(float(np.ptp(recording.motor_position[:, 0])) for recording in recordings)
    travel = usable(max(map(range_of_tendon, mechanisms)), radius * moved)
    return scale_by(force, travel, radius, is_shaft=turns_a_shaft(mechanisms[0]))


def greatest_force(recording: Recording, model: Model, radius: float, limit: float) -> float:
    """Return the force [N] that a recording shows, or what its commands ask of the actuator.

    Args:
        recording: The recording.
        model: Model with the actuator's numbers.
        radius: Radius of the spool [m].
        limit: Force limit of the servo [N]: commands may ask for more than it gives.
    """
    if recording.force is not None:
        return float(np.nanquantile(np.abs(recording.force[:, 0]), NEARLY_ALL))
    if recording.command is None:
        return 0.0
    error = np.abs(recording.command[:, 0] - recording.motor_position[:, 0])
    values = {**model.actuator.values, **recording.actuator_overrides}
    asked = float(np.nanquantile(error, NEARLY_ALL))
    return min(limit, find_actuator(model.actuator.name).static_force(values, asked, radius))


def usable(stated: float, shown: float) -> float:
    """Return what a machine can do: what is stated of it, if what it showed bears that out."""
    low, high = USED
    return stated if shown == 0.0 or low * stated <= shown <= high * stated else SPARE * shown

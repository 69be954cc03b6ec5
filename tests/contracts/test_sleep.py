"""An effect is passed over where all its numbers are null, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from tendon_newton.device_code.placeholders import DeviceArray, ParameterVector
from tendon_newton.device_code.templates import device_template
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import InvalidDeviceCode
from tendon_newton.simulation.model.assembly import assemble
from tendon_newton.simulation.model.parameter_table import ParameterTable
from tendon_newton.simulation.model.structure import Structure
from tendon_newton.simulation.tendons.world_drive import sleepers

NAMES = tuple(EFFECTS)
STRUCTURE = Structure(
    parents=(-1,), revolute=(True,), tendon_count=1, actuator="pwm_servo", effects=NAMES
)


@device_template
def sleepers_kernel(
    parameters: DeviceArray[ParameterVector], asleep: DeviceArray[wp.int64]
) -> None:
    """Write which effects sleep in each world."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    asleep[i] = sleepers(parameters[i])


def test_one_number_off_null_wakes_its_effect_alone() -> None:
    """Every number of the catalogue in a world of its own, and a world without any."""
    table = ParameterTable(actuator=STRUCTURE.actuator, effects=NAMES)
    owners = [(c, n, p) for c, (n, p) in enumerate(table.owners) if n in EFFECTS]
    worlds = np.tile(table.null_vector(), (len(owners) + 1, 1))
    for world, (column, _, parameter) in enumerate(owners):
        ends = (parameter.nominal, parameter.lower, parameter.upper)
        worlds[world, column] = next(v for v in ends if v != parameter.null)
    assembly = assemble(STRUCTURE)
    asleep = wp.zeros(len(worlds), dtype=wp.int64, device="cpu")
    wp.launch(
        assembly.kernel(sleepers_kernel),
        len(worlds),
        inputs=[wp.array(worlds, dtype=assembly.types[ParameterVector], device="cpu"), asleep],
        device="cpu",
    )
    every = (1 << len(NAMES)) - 1
    awake = [1 << NAMES.index(name) for _, name, _ in owners]
    assert asleep.numpy().tolist() == [*(every & ~bit for bit in awake), every]


def test_more_effects_than_a_world_can_tell_apart_are_refused() -> None:
    """A bit each, in one number."""
    many = Structure(
        parents=(-1,), revolute=(True,), tendon_count=1, actuator="ideal", effects=NAMES * 2
    )
    with pytest.raises(InvalidDeviceCode, match=f"at most 63 effects; it has {2 * len(NAMES)}"):
        assemble(many)

"""What the sensors of a bench can say at all: a rule beyond that would never act."""

from dataclasses import dataclass
from math import inf

from tendon_hardware.benches.bench import BenchDrive
from tendon_hardware.load_cells.load_cell_type import SATURATED_COUNTS
from tendon_hardware.safety_rules.force_estimate import ForceEstimate

Range = tuple[float, float]  # Least and greatest value


@dataclass(frozen=True, kw_only=True, slots=True)
class SensorReach:
    """Ranges of what one servo and the load cell in its tendon can say."""

    position: Range  # Angles of the spool that its register can hold [rad]
    voltage: Range  # Voltages of the supply that its register can hold [V]
    current: Range  # Supply current [A]: a motor takes no more than at standstill
    # Temperature of the motor [degC]: beyond it the servo has switched itself off
    temperature: Range
    # Tension [N]: up to where the load cell saturates, or the estimate is cut; none where
    # nothing tells it
    force: Range | None


def reach_of(drive: BenchDrive, estimate: ForceEstimate | None = None) -> SensorReach:
    """Return what can be said of one servo and its tendon."""
    spec, table = drive.servo.spec, drive.servo.table
    turns = inf  # followed by the driver
    if table.counts_turns:
        turns = 2.0 ** (8 * table.position.size - 1) * spec.position_unit
    return SensorReach(
        position=(-turns, turns),
        voltage=(0.0, (2.0 ** (8 * table.voltage.size) - 1.0) * spec.voltage_unit),
        current=(-spec.stall_current, spec.stall_current),
        temperature=(-inf, spec.temperature_limit),
        force=force_reach(drive, estimate),
    )


def force_reach(drive: BenchDrive, estimate: ForceEstimate | None) -> Range | None:
    """Return the tensions that a load cell, or in its place a network, can tell [N]."""
    if drive.load_cell is not None and drive.calibration is not None:
        ends = [float(drive.calibration.force(counts)) for counts in SATURATED_COUNTS]
        return (0.0, max(ends))
    return None if estimate is None else (0.0, estimate.card.force_limit)

"""The numbers of the safety rules that a deployment obeys."""

from dataclasses import dataclass, field
from math import isfinite

from tendon_hardware.safety_rules.bench_limits import SafetyLimits
from tendon_hardware.servos.base import ServoSpec
from tendon_newton.data.cards.policy_observation import COMMAND_SPEED
from tendon_newton.errors import InvalidParameter

CURRENT_SHARE = 0.65
"""Supply current that is allowed, of the current at standstill and full duty [1]: with the default
loop nothing but a stuck gear at 80 % of duty takes as much."""
SKIP_WINDOW = 8  # Ticks among which skipped ones are counted
OUTPUT_SHARE = 10.0
"""Outputs of a policy that are believed, in its clips [1]; PPO's mean may well leave the clip."""


@dataclass(frozen=True, kw_only=True, slots=True)
class DeployLimits:
    """Limits of a policy and its bench; each is a row of the table of rules."""

    # Force, temperature and window, the same as while data is collected
    bench: SafetyLimits = field(default_factory=SafetyLimits)
    voltage: tuple[float, float] = (6.5, 12.6)  # Supply voltages at which the servo works [V]
    current: float = 0.52  # Greatest supply current [A]
    # Difference of the duty that a servo gives from the one that it was sent [1]
    duty: float = 0.05
    # Way of a spool beyond what its motor can have made [rad]: 0.75 mm of the finger's tendon, and
    # twice the error of an encoder that is a degree off centre
    motion: float = 0.06
    # Time without a reading of the servo after which it counts as lost [s]: its own watchdog
    silence: float = 0.2
    # Greatest age of a position that a policy may act upon [s]: four ticks at 80 Hz
    stale_state: float = 0.05
    # Greatest age of a tension [s]: between five and six readings at 80 Hz
    stale_force: float = 0.07
    skipped_ticks: int = 3  # Ticks that may be skipped among eight in a row: a policy step is four
    output: float = 20.0  # Greatest output of a policy [rad]
    # Greatest change of the command [rad/s]: four radians in a policy step
    command_rate: float = COMMAND_SPEED

    def __post_init__(self) -> None:
        low, high = self.voltage
        if not (isfinite(low) and isfinite(high) and 0.0 <= low < high):
            raise InvalidParameter(f"the voltages must be low, high; they are {low}, {high} V")
        for name in (
            *("current", "duty", "motion", "silence", "stale_state", "stale_force"),
            *("output", "command_rate"),
        ):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0.0):
                raise InvalidParameter(f"the limit of {name} must be above 0; it is {value}")
        if self.skipped_ticks < 0:
            raise InvalidParameter(f"skipped_ticks must be 0 or more; it is {self.skipped_ticks}")


def limits_for(
    spec: ServoSpec, bench: SafetyLimits, *, clip: float, load_cell_rate: float | None
) -> DeployLimits:
    """Return the limits that follow from a servo, a policy and a load cell.

    Args:
        clip: Greatest action of the policy [rad].
        load_cell_rate: Readings per second of the load cell [Hz], where it is known.
    """
    low, high = spec.supply_range
    slow = load_cell_rate is not None and load_cell_rate < 60.0
    return DeployLimits(
        bench=bench,
        voltage=(low, 1.05 * high),
        current=CURRENT_SHARE * spec.stall_current,
        output=OUTPUT_SHARE * clip,
        # two readings of a slow cell may be lost; a fast one is noticed within a tenth of a second
        stale_force=3.5 / load_cell_rate if slow and load_cell_rate else DeployLimits().stale_force,
    )

"""Settings of a recording that all runs of a session share."""

from dataclasses import dataclass, field

from tendon_hardware.pacing import refuse_rates
from tendon_hardware.safety_rules.bench_limits import SafetyLimits
from tendon_hardware.servos.host_position_loop import HostPositionLoop
from tendon_newton.data.cards.policy_observation import SERVO_RATE
from tendon_newton.errors import InvalidParameter

COMMAND_RATE = 20.0  # Commands per second unless given [Hz]: what the bench of the paper used


@dataclass(frozen=True, kw_only=True)
class CollectSettings:
    """Rates, the position loop, limits, and what is drawn."""

    rate: float = SERVO_RATE  # Readings of the servo per second [Hz]
    # Commands per second [Hz], of which the rate is a whole multiple
    command_rate: float | None = None
    # The position loop; it runs here, as on the paper's bench
    loop: HostPositionLoop = field(default_factory=HostPositionLoop)
    settle: float = 1.5  # Rest at the first command before the first row [s]
    limits: SafetyLimits = field(default_factory=SafetyLimits)  # Limits that end a run
    seed: int = 0  # Seed of the excitations' draws
    # Radius of the bench's spool [m], for the model beside the recordings
    spool_radius: float = 0.0125
    notes: str = ""  # Words of the operator to keep with the log

    def __post_init__(self) -> None:
        refuse_rates(self.rate, self.commands, "the command rate")
        if not 0.0 <= self.settle <= 60.0:
            raise InvalidParameter(f"the rest must be 0 to 60 s; it is {self.settle:g} s")
        if not 1e-4 <= self.spool_radius <= 0.5:
            raise InvalidParameter(
                f"a spool's radius must be 0.0001 to 0.5 m; it is {self.spool_radius:g} m"
            )

    @property
    def commands(self) -> float:
        """Commands per second [Hz]."""
        if self.command_rate is not None:
            return self.command_rate
        return min(self.rate, COMMAND_RATE)

    @property
    def divider(self) -> int:
        """Ticks per command."""
        return round(self.rate / self.commands)

"""Settings of a deployment, and conditions that must hold before its motor may run."""

from dataclasses import dataclass, field, replace
from math import isfinite

from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.errors import PolicyMismatch
from tendon_hardware.pacing import refuse_rates
from tendon_hardware.safety_rules.rule_limits import DeployLimits
from tendon_hardware.servos import find_servo
from tendon_hardware.servos.host_position_loop import HostPositionLoop
from tendon_hardware.virtual_bench.physics.unit import servo_count
from tendon_newton.data.cards.policy_card import FurtherServo, PolicyCard
from tendon_newton.data.cards.policy_observation import RATE, SERVO_RATE
from tendon_newton.errors import InvalidParameter

RADIUS_TOLERANCE = 1e-3  # Difference of spool radii that is none [1]: 12.5 um of the finger's spool
QUICKEST = 0.5
"""Share of an error that a loop may take away until its next command [1]: one that a servo closed
itself, hundreds of times a second, swings at the rate of the commands."""


@dataclass(frozen=True, kw_only=True)
class DeploySettings:
    """Rates, the position loop, limits and length."""

    rate: float = SERVO_RATE  # Readings of the servo per second [Hz]
    policy_rate: float = RATE  # Policy steps and commands per second [Hz]
    spool_radius: float = 0.0125  # Spool radius of the bench [m]
    # The position loop, which runs here as on the paper's bench, and its command range
    loop: HostPositionLoop = field(default_factory=HostPositionLoop)
    further_loops: tuple[HostPositionLoop, ...] = ()  # Loops of further servos
    watchdog: float = 0.2  # Silence on the bus after which the servo stops by itself [s]
    limits: DeployLimits = field(default_factory=DeployLimits)  # Limits that end or cut a run
    duration: float | None = None  # Length [s]; none ends with the operator's stop
    dry: bool = False  # Whether the motor stays off
    # Whether the tendon is let out at the end; if not, the motor is just switched off
    unwind: bool = True
    notes: str = ""  # Words of the operator to keep with the log

    def __post_init__(self) -> None:
        refuse_rates(self.rate, self.policy_rate, "the policy's")
        if self.duration is not None and not (isfinite(self.duration) and self.duration > 0.0):
            raise InvalidParameter(f"the duration must be above 0 s; it is {self.duration}")

    @property
    def loops(self) -> tuple[HostPositionLoop, ...]:
        """The position loop of each servo."""
        return (self.loop, *self.further_loops)

    @property
    def servo_limits(self) -> tuple[DeployLimits, ...]:
        """Limits of each servo: windows lie about the command ranges as the first one's does."""
        low, high = self.limits.bench.position
        every = [self.limits]
        for loop in self.further_loops:
            shift = loop.position_range[0] - self.loop.position_range[0]
            window = replace(self.limits.bench, position=(low + shift, high + shift))
            every.append(replace(self.limits, bench=window))
        return tuple(every)

    @property
    def divider(self) -> int:
        """Ticks per policy step."""
        return round(self.rate / self.policy_rate)


def loops_of(card: PolicyCard) -> tuple[HostPositionLoop, ...]:
    """Return the position loop of each servo that a policy drives: that of its training."""
    own = card.loop
    law = {} if own is None else {"gain": own.gain, "duty_limit": own.limit, "offset": own.offset}
    return tuple(
        HostPositionLoop(
            **law,
            position_range=servo.turning_range,
            pay_out=None if servo.pay_out is None else (servo.command_range[0], servo.pay_out[1]),
        )
        for servo in (card, *card.further_servos)
    )


def refuse_mismatch(card: PolicyCard, settings: DeploySettings, address: BenchAddress) -> None:
    """Refuse a policy that was trained for another bench.

    Raises:
        PolicyMismatch: Rates, servo, spool or limits differ; the message names both sides.
    """
    servos = servo_count(address.bench) if address.virtual else len(address.drives)
    agreements = [
        ("rate_hz", card.rate == settings.policy_rate, f"{card.rate:g}",
            f"{settings.policy_rate:g}"),
        ("servo_rate_hz", card.servo_rate == settings.rate, f"{card.servo_rate:g}",
            f"{settings.rate:g}"),
        ("servos", card.servo_count == servos, f"{card.servo_count}", f"{servos}"),
    ]  # fmt: skip
    if card.turning is not None:
        asset = card.turning.asset
        agreements.append(("turning.asset", asset == address.bench, asset, address.bench))
    for place, (servo, limits) in enumerate(
        zip((card, *card.further_servos), settings.servo_limits, strict=False)
    ):
        of = f" of servo {place}" if place else ""
        agreements += [
            (f"{name}{of}", *rest)
            for name, *rest in servo_agreements(servo, limits, settings, address)
        ]
    if card.loop is not None:
        fastest = QUICKEST * settings.policy_rate / find_servo(address.servo).free_speed
        agreements.append(
            ("position_loop of duty per rad", card.loop.gain <= fastest, f"{card.loop.gain:.3g}",
                f"closes one of {fastest:.3g} at most, {settings.policy_rate:g} times a second")
        )  # fmt: skip
    for name, agrees, trained, here in agreements:
        if not agrees:
            raise PolicyMismatch(
                f"a policy drives the bench that it was trained for; its card has {name} "
                f"{trained}, this bench {here}"
            )


def servo_agreements(
    servo: PolicyCard | FurtherServo,
    limits: DeployLimits,
    settings: DeploySettings,
    address: BenchAddress,
) -> tuple[tuple[str, bool, str, str], ...]:
    """Return what a card says of one servo: a name, whether the bench agrees, and both sides."""
    low, high = limits.bench.position
    least, greatest = servo.turning_range
    radius = servo.spool_radius
    return (
        ("servo", servo.servo == address.servo, servo.servo, address.servo),
        ("spool_radius_m", abs(radius / settings.spool_radius - 1.0) <= RADIUS_TOLERANCE,
            f"{radius:g}", f"{settings.spool_radius:g}"),
        ("command_range_rad", low <= least and greatest <= high, f"{least:.3f} to {greatest:.3f}",
            f"{low:.3f} to {high:.3f} at most"),
        ("force_limit_n", servo.force_limit <= limits.bench.force, f"{servo.force_limit:g}",
            f"{limits.bench.force:g} at most"),
    )  # fmt: skip

"""Settings of the task to turn a ball."""

from dataclasses import dataclass

from tendon_newton.errors import require

RANGES = ("turn_rates", "camera_noise", "camera_delay")
POSITIVE = ("drop_distance", "rate_window", "catch_up_time", "start_command")
NOT_NEGATIVE = ("rate_weight", "place_weight", "drop_price", "size_spread")


@dataclass(frozen=True, kw_only=True)
class TurningConfig:
    """What a hand is paid for that turns a ball, and how a camera sees the ball."""

    turn_rates: tuple[float, float] = (0.5, 1.5)
    """Least and greatest commanded rate about the axis across the palm [rad/s], a rate an
    episode."""
    drop_distance: float = 0.015
    """Distance of the ball's middle from where it starts beyond which it is dropped [m]."""
    start_command: float = 3.5
    """Greatest command at the start of an episode [rad], the smaller the likelier: fingers are open
    or just hold the ball."""
    rate_window: float = 1.0  # Time constant of the mean rate that is paid for [s].
    catch_up_time: float = 1.0
    """Time in which a ball that is behind or ahead shall be so no longer [s]."""
    rate_weight: float = 1.0
    """Pay for the mean rate up to the one that is wanted [s/rad]; as much is taken off beyond."""
    place_weight: float = 20.0  # Price of the ball's distance from where it starts [1/m].
    drop_price: float = 10.0  # Price of a drop [1]; the episode ends there.
    size_spread: float = 0.02  # Most that a ball's radius differs, as a share of it [1].
    camera_noise: tuple[float, float] = (5.0e-4, 1.5e-3)
    """Least and greatest standard deviation of each coordinate that a camera gives [m]."""
    camera_delay: tuple[int, int] = (1, 2)
    """Least and greatest age of what a camera gives [policy steps]."""

    def __post_init__(self) -> None:
        require(self, "be positive", lambda x: x > 0.0, POSITIVE)
        require(self, "not be negative", lambda x: x >= 0.0, NOT_NEGATIVE)
        numbers = "be a least and a greatest number from 0 up"
        require(self, numbers, lambda x: 0.0 <= x[0] <= x[1] <= 100.0, RANGES)
        fits = "be at most 0.1, else a ball does not fit"
        require(self, fits, lambda x: x <= 0.1, ["size_spread"])

"""How long a training will take, told before it starts."""

import time
from dataclasses import dataclass

import torch

from tendon_train.policy.worlds.environment import FingerEnvironment

LONGEST = 1.0  # Time that is spent on timing at least, unless one step takes longer [s]
STEPS = 20  # Most steps of all worlds that are timed, after one that compiles and warms up


@dataclass(frozen=True, kw_only=True)
class Forecast:
    """Size, device and time of a training that is about to start."""

    steps: int  # Policy steps that are left, of all worlds
    worlds: int
    device: str  # Torch's word for the device
    # Time that acting takes; learning comes on top, and is little beside it on a CPU [s]. None
    # before any step was timed.
    seconds: float | None = None

    @property
    def text(self) -> str:
        """The figures as a line: the size first, and the time once it is known."""
        if self.seconds is not None:
            acting = f"about {time_in_words(self.seconds)} for {self.steps:,} steps"
            return f"{acting}, and what learning takes"
        where, gpu = "the CPU", "; torch finds no GPU here"
        if torch.device(self.device).type == "cuda":
            where, gpu = torch.cuda.get_device_name(self.device), ""
        elif torch.cuda.is_available():
            gpu = "; a GPU is there and not used (--device cuda)"
        return (
            f"{self.steps:,} steps of {self.worlds:,} fingers on {where}{gpu}; "
            "compiling, and timing a few"
        )


def timed(environment: FingerEnvironment, steps: int) -> Forecast:
    """Forecast so many steps of all worlds by timing some; the environment must begin anew then."""
    device = torch.device(environment.device)
    actions = torch.zeros(environment.num_envs, environment.num_actions)
    environment.step(actions)
    begin, count = now(device), 0
    while count == 0 or (count < STEPS and now(device) - begin < LONGEST):
        environment.step(actions)
        count += 1
    pace = (now(device) - begin) / (count * environment.num_envs)
    return Forecast(
        steps=steps, worlds=environment.num_envs, device=str(device), seconds=pace * steps
    )


def now(device: torch.device) -> float:
    """Return the time once a device has done what it was given [s]."""
    if device.type == "cuda":
        torch.cuda.synchronize(device)
    return time.monotonic()


def time_in_words(seconds: float) -> str:
    """Return a time as people say it."""
    for unit, length in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:.0f} {unit}"
    return f"{max(seconds, 1.0):.0f} s"

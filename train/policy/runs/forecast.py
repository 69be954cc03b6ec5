"""How long a training will take, told before it starts."""

from __future__ import annotations

import time
from dataclasses import dataclass

import torch

from train.policy.worlds.environment import FingerEnvironment

TIMED_STEPS = 3
"""Steps of all worlds that are timed, after one that compiles and warms up."""


@dataclass(frozen=True, kw_only=True)
class Forecast:
    """Size, device and time of a training that is about to start."""

    steps: int
    """Policy steps that are left, of all worlds."""
    worlds: int
    device: str
    """Name of the device, as people know it."""
    seconds: float
    """Time that acting takes; learning comes on top, and is little beside it on a CPU [s]."""
    idle_gpu: bool
    """Whether a GPU is there and not used."""

    @property
    def text(self) -> str:
        """The figures as a line."""
        if self.idle_gpu:
            gpu = "; a GPU is there and not used (--device cuda)"
        elif self.device == "the CPU":
            gpu = "; torch finds no GPU here"
        else:
            gpu = ""
        return (
            f"{self.steps:,} steps of {self.worlds:,} fingers on {self.device}, "
            f"about {time_in_words(self.seconds)}{gpu}"
        )


def forecast(environment: FingerEnvironment, steps: int) -> Forecast:
    """Time some steps of all worlds; whoever trains must let the environment begin anew.

    Args:
        environment: The fingers that will learn.
        steps: Policy steps that are left, of all worlds.
    """
    device = torch.device(environment.device)
    actions = torch.zeros(environment.num_envs, environment.num_actions)
    environment.step(actions)
    begin = now(device)
    for _ in range(TIMED_STEPS):
        environment.step(actions)
    pace = (now(device) - begin) / (TIMED_STEPS * environment.num_envs)
    on_cpu = device.type == "cpu"
    return Forecast(
        steps=steps,
        worlds=environment.num_envs,
        device="the CPU" if on_cpu else torch.cuda.get_device_name(device),
        seconds=pace * steps,
        idle_gpu=on_cpu and torch.cuda.is_available(),
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

"""Settings of the training of a force network."""

from dataclasses import dataclass
from typing import Annotated, Literal

import tyro

from tendon_newton.errors import look_up, require
from tendon_newton.force_networks import FORCE_NETWORKS, SetName

Kind = Annotated[str, tyro.conf.arg(metavar=f"{{{','.join(FORCE_NETWORKS)}}}")]
"""A key of `FORCE_NETWORKS`."""
Purpose = Literal["prediction", "simulation"]
COUNTS = ("window", "epochs", "patience", "windows_per_epoch", "batch", "threads")
SERVO_LIMIT = 21.0
"""Tension that the paper's servo can produce [N]; errors are given as shares of it."""


@dataclass(frozen=True, kw_only=True)
class TrainingConfig:
    """How one force network is trained; the same config and data give the same network."""

    network: Kind = "transformer"  # Family of the network.
    set: SetName = "paper"
    """Where its sizes come from: the paper's text, its authors' code, or equal parameter counts."""
    purpose: Purpose = "prediction"
    """Purpose of the network: the force along measured motion, as precise as possible, or the loop
    of a simulation, with the force beside all measured motion."""
    seed: int = 0  # Seed of the starting weights and the order of the windows.
    window: int = 30  # Samples that the network sees.
    rate: float = 20.0  # Samples per second [Hz].
    force_limit: float | None = None
    """Tension that the servo can produce [N], to which users of the network clip. The default is 21
    N, or a twentieth more than the largest force in training where that is more."""
    epochs: int = 30  # Most epochs: a million windows, each of the paper's 36 minutes eight times.
    patience: int = 30  # Epochs without a better validation error after which training stops.
    windows_per_epoch: int = 32768
    """Windows that an epoch draws, without repetition, from all of them."""
    batch: int = 128  # Windows per step.
    learning_rate: float = 3.0e-3
    """The highest, of Adam; it falls to nothing along a cosine over all epochs."""
    disturb: bool = True
    """Whether each window that is drawn gets other noise and another zero of its angles."""
    device: str = "cpu"  # cpu or cuda.
    threads: int = 1  # Threads of torch on the CPU.

    def __post_init__(self) -> None:
        require(self, "be 1 or more", lambda x: x >= 1, COUNTS)
        optional = ("rate", "learning_rate", "force_limit")
        require(self, "be positive", lambda x: x is None or 0.0 < x < 1.0e6, optional)
        look_up("network", self.network, FORCE_NETWORKS)

    @property
    def name(self) -> str:
        """Name of the network's files, without their ending."""
        purpose = "" if self.purpose == "prediction" else f"-{self.purpose}"
        return f"{self.network}{purpose}-{self.set}-{self.seed}"

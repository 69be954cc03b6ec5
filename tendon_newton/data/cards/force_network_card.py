"""The card of a force network: what goes in, what comes out, and where it comes from.

It is the JSON text ``card.json`` among the extra files of a TorchScript file, and the value of
``card`` in the metadata of an ONNX file. Reading it needs neither torch nor onnxruntime.
"""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Literal

from tendon_newton.data.cards.card_json import read_card_json, refuse_broken
from tendon_newton.data.files.checked_table import STATED, table_of
from tendon_newton.errors import InvalidNetworkFile

SCHEMA = 1
INPUTS = ("theta_d", "theta", "theta_dot")
UNITS = ("rad", "rad", "rad/s", "N")  # Units of the inputs, then of the output
KIND = re.compile(r"[a-z][a-z0-9_]{0,31}")
"""A name. The table of force networks says which kinds there are; a program that only runs an ONNX
file need not know them."""
PURPOSES = ("prediction", "simulation")
HOLD_LIMIT = 1000.0
"""Largest stiffness [N/rad] and damping [N s/rad] of a card: a hundred times a hobby servo's."""


@dataclass(frozen=True, kw_only=True)
class HoldLaw:
    """How a network's force answers to the shaft until the network is asked again."""

    # By how much it falls as the shaft turns [N/rad], and as it turns faster [N s/rad]
    stiffness: float = field(default=0.0, metadata={"key": "stiffness_n_per_rad"})
    damping: float = field(default=0.0, metadata={"key": "damping_n_s_per_rad"})

    def __post_init__(self) -> None:
        for name in ("stiffness", "damping"):
            value = getattr(self, name)
            if not 0.0 <= value <= HOLD_LIMIT:
                raise InvalidNetworkFile(
                    f"card: {name} of hold must be 0 to {HOLD_LIMIT:g}; it is {value!r}"
                )


PLAIN_HOLD = HoldLaw()  # The paper's: the force stays as it is


@dataclass(frozen=True, kw_only=True)
class TrainingRecording:
    """One recording that a network was trained on or chosen by."""

    file: str  # Name inside its dataset
    sha256: str  # SHA-256 of the file's bytes, or for a folder of its files' names and bytes
    # Whether its windows were fitted, or only told when to stop; both are train recordings
    split: Literal["train", "validation"]


@dataclass(frozen=True, kw_only=True)
class Training:
    """How a network came about."""

    recordings: tuple[TrainingRecording, ...]  # Recordings that it has seen
    split: str  # How held-out data was held out, in words
    seed: int  # Seed of the starting weights and the order of the windows
    git_commit: str | None  # Commit of the program, where it ran from a clone
    version: str  # Version of the program


@dataclass(frozen=True, kw_only=True)
class HeldOut:
    """Errors on recordings that the network has never seen."""

    force_rmse: float  # Pooled over all rows [N]
    noise_floor: float | None  # Estimated standard deviation of the load cell's noise [N]
    rows: int  # Rows that were predicted
    recordings: tuple[str, ...]  # Names inside the dataset


@dataclass(frozen=True, kw_only=True)
class ForceNetworkCard:
    """What a program must know to use a force network, checked when built."""

    kind: str  # Family of the network
    network_set: str = ""  # Set that its sizes come from
    parameter_count: int = 0  # Trained numbers
    window: int  # Samples in a window, oldest first
    rate: float = field(metadata={"key": "rate_hz"})  # Samples per second [Hz]
    # Tension that the servo can produce [N]; a user of the network clips to 0 ... limit.
    force_limit: float = field(metadata={"key": "force_limit_n"})
    # Smallest and largest value of each input in training, in its unit
    bounds: Mapping[str, tuple[float, float]]
    training: Training
    servo: str | None = None  # Kind of the servo, where the recordings said it
    held_out: HeldOut | None = None  # Absent where the dataset has no test recordings
    # What it was trained for: forces along measured motion, or the loop of a simulation
    purpose: Literal["prediction", "simulation"] = "prediction"
    hold: HoldLaw = PLAIN_HOLD  # What a simulation makes of its force between two queries
    inputs: tuple[str, ...] = field(default=INPUTS, metadata=STATED)  # Columns of a sample
    # Units of the inputs, then of the output
    units: tuple[str, ...] = field(default=UNITS, metadata=STATED)
    # Whether it runs on one sample at a time with its state kept, which none does
    streaming: bool = field(default=False, metadata=STATED)
    schema: int = field(default=SCHEMA, metadata=STATED)

    def __post_init__(self) -> None:
        promises = (
            ("schema", self.schema, self.schema == SCHEMA, f"{SCHEMA}"),
            ("kind", self.kind, bool(KIND.fullmatch(str(self.kind))), "a name in small letters"),
            ("purpose", self.purpose, self.purpose in PURPOSES, f"one of {', '.join(PURPOSES)}"),
            ("inputs", list(self.inputs), self.inputs == INPUTS, f"{list(INPUTS)}"),
            ("units", list(self.units), self.units == UNITS, f"{list(UNITS)}"),
            ("streaming", self.streaming, not self.streaming, "false: it is asked with windows"),
            ("window", self.window, 1 <= self.window <= 10_000, "1 to 10000 samples"),
            ("rate_hz", self.rate, 0.1 <= self.rate <= 10_000.0, "0.1 to 10000 Hz"),
            ("force_limit_n", self.force_limit, 0.0 < self.force_limit <= 1000.0, "up to 1000 N"),
        )
        refuse_broken(promises, InvalidNetworkFile)
        for name in INPUTS:
            low, high = self.bounds.get(name, (1.0, 0.0))
            if not (isfinite(low) and isfinite(high) and low <= high):
                raise InvalidNetworkFile(
                    f"card: bounds must hold {name} with its smallest and largest value; "
                    f"there is {self.bounds.get(name)!r}"
                )

    def to_json(self) -> str:
        """Return the card as it stands in a file."""
        return json.dumps(table_of(self), indent=1)

    @staticmethod
    def from_json(text: str) -> "ForceNetworkCard":
        """Read and check a card.

        Raises:
            InvalidNetworkFile: The text is no JSON object, or a value is missing or mistyped.
        """
        first = {"schema": SCHEMA, "units": list(UNITS)}
        return read_card_json(
            text, lambda table: table.record(ForceNetworkCard), first, InvalidNetworkFile
        )

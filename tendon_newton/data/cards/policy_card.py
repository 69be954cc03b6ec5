"""The card of a policy: what it sees, what it does, and the bench that it was trained for.

The card is the JSON text ``card.json`` among the extra files of a TorchScript file, and the value
of ``card`` in the metadata of an ONNX file. Reading it needs neither torch nor onnxruntime.
"""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite, pi
from pathlib import PurePath
from typing import Literal

from tendon_newton.data.cards.card_json import Promise, read_card_json, refuse_broken
from tendon_newton.data.cards.policy_observation import (
    HISTORY,
    RATE,
    SAMPLE,
    SERVO_RATE,
    Task,
    sample_of,
)
from tendon_newton.data.cards.turning_task import TurningTask
from tendon_newton.data.files.checked_table import STATED, CheckedTable, table_of
from tendon_newton.errors import InvalidPolicyFile
from tendon_newton.frozen_mapping import frozen

SCHEMA = 1
CARD_NAME = "card.json"  # Name among the extra files of a TorchScript file
CARD_KEY = "card"  # Key in the metadata of an ONNX file
ACTION_UNIT, ACTION_MEANING = "rad", "motor position offset"
NORMALISATIONS = ("in_network", "none")
RATE_TOLERANCE = 1e-9
GOAL_RANGES: dict[Task, str] = {"tip": "goal_range_rad", "turn": "rate_range_rad_s"}
"""Key of the goals of a task in a card."""
TIP_GOALS = (0.0, pi / 2.0)  # Goals of a policy whose card says none [rad]
DEEPEST_COMMAND = 2.0
"""Farthest that a pay-out rule lets a command below home [rad]: a fifth of the full duty."""
USD_ENDINGS = (".usda", ".usd", ".usdc", ".usdz")
HASH = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True, kw_only=True)
class PolicyTraining:
    """Seed, program, samples and force model of a policy's training."""

    seed: int  # Seed of the starting weights and of every draw
    git_commit: str | None  # Commit of the program, where it ran from a clone
    version: str  # Version of the program
    samples: int = 0  # Policy steps that it has learnt from
    force: str = ""  # Force model of the simulation, in words or as a file's name
    # Name -> least and greatest factor (or value) that a world could have
    randomisation: Mapping[str, tuple[float, float]] = field(
        default_factory=dict[str, tuple[float, float]]
    )
    # Name -> SHA-256 of each further file that the training read
    files: Mapping[str, str] = field(default_factory=dict[str, str])

    @property
    def finger(self) -> str | None:
        """Name of the finger: that of its USD file, which is one of the files."""
        drawn = (PurePath(name) for name in self.files if name.endswith(USD_ENDINGS))
        return next((path.stem for path in drawn), None)

    def __post_init__(self) -> None:
        for name in ("randomisation", "files"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


@dataclass(frozen=True, kw_only=True)
class DutyLoop:
    """The position loop of the servos in training, from an angle to a duty."""

    gain: float = field(metadata={"key": "duty_per_rad"})  # Duty per angle [1/rad]
    limit: float = field(metadata={"key": "max_duty"})  # Greatest duty [1]
    offset: float = field(default=0.0, metadata={"key": "duty_offset"})  # Always added [1]

    @property
    def sound(self) -> bool:
        """Whether such a loop can be."""
        return 0.0 < self.gain <= 100.0 and abs(self.offset) < self.limit <= 1.0


@dataclass(frozen=True, kw_only=True)
class FurtherServo:
    """A servo of a policy beyond its first, on the next tendon of the asset."""

    # Least and greatest desired motor angle [rad]
    command_range: tuple[float, float] = field(metadata={"key": "command_range_rad"})
    # Spool radius of the bench of the training [m]
    spool_radius: float = field(metadata={"key": "spool_radius_m"})
    servo: str  # Name in the table of servos
    # Tension that it can produce in training [N]
    force_limit: float = field(metadata={"key": "force_limit_n"})
    # Pay-out rule of this servo [rad], where it has one
    pay_out: tuple[float, float] | None = field(default=None, metadata={"key": "pay_out_rad"})

    @property
    def turning_range(self) -> tuple[float, float]:
        """Angles between which commands let the spool come to rest [rad]."""
        return turning_range(self)


@dataclass(frozen=True, kw_only=True)
class PolicyCard:
    """What a program must know to run a policy, checked when built.

    Command range, pay-out rule, spool, servo and force limit are those of the first servo; those
    of the others stand in `further_servos`.
    """

    # Least and greatest desired motor angle [rad]
    command_range: tuple[float, float] = field(metadata={"key": "command_range_rad"})
    # Spool radius of the bench of the training [m]
    spool_radius: float = field(metadata={"key": "spool_radius_m"})
    servo: str  # Name in the table of servos
    # Tension that the servo can produce in training [N]
    force_limit: float = field(metadata={"key": "force_limit_n"})
    action_clip: float  # Greatest action either way [rad]
    training: PolicyTraining
    # Least command of a motor at home, and the angle beyond which it is not at home [rad]; where
    # there is none the whole command range counts everywhere. `motor_command` is its definition.
    pay_out: tuple[float, float] | None = field(default=None, metadata={"key": "pay_out_rad"})
    # SHA-256 of the ``model.toml`` that it was trained on; absent for a model without a file
    model: str | None = field(default=None, metadata=STATED)
    # Goals that it has met in training: angles [rad], or rates [rad/s] of a policy that turns
    goal_range: tuple[float, float] = field(default=TIP_GOALS, metadata=STATED)
    # Policy steps per second [Hz]
    rate: float = field(default=RATE, metadata=STATED | {"key": "rate_hz"})
    # Readings of the servo per second [Hz], a whole multiple of the rate
    servo_rate: float = field(default=SERVO_RATE, metadata=STATED | {"key": "servo_rate_hz"})
    # Samples in an observation, oldest first
    history: int = field(default=HISTORY, metadata=STATED)
    # Where inputs are normalised; either way the file takes them in SI units
    normalisation: Literal["in_network", "none"] = field(default="in_network", metadata=STATED)
    # Name and unit of each number of a sample
    observation: tuple[tuple[str, str], ...] = field(default=SAMPLE, metadata=STATED)
    action_unit: str = field(default=ACTION_UNIT, metadata=STATED)
    action_meaning: str = field(default=ACTION_MEANING, metadata=STATED)
    # Where the force of the training came of a duty, the loop that gave it; else the bench's own
    loop: DutyLoop | None = field(default=None, metadata={"key": "position_loop"})
    # The servos beyond the first, in the order of the asset's tendons
    further_servos: tuple[FurtherServo, ...] = ()
    # Task of a policy that turns a ball; where there is none the tip goes to a goal
    turning: TurningTask | None = None
    schema: int = field(default=SCHEMA, metadata=STATED)

    def __post_init__(self) -> None:
        ratio = self.servo_rate / self.rate if self.rate > 0.0 else 0.0
        sample = sample_of(self.servo_count, self.task)
        promises = (
            ("schema", self.schema, self.schema == SCHEMA, f"{SCHEMA}"),
            ("observation", self.observation, self.observation == sample,
                json.dumps([list(pair) for pair in sample])),
            ("history", self.history, 1 <= self.history <= 10_000, "1 to 10000 samples"),
            ("rate_hz", self.rate, 0.1 <= self.rate <= 1000.0, "0.1 to 1000 Hz"),
            (
                "servo_rate_hz",
                self.servo_rate,
                1.0 - RATE_TOLERANCE <= ratio <= 1000.0
                and abs(ratio - round(ratio)) < RATE_TOLERANCE,
                "a whole multiple of rate_hz",
            ),
            ("action.unit", self.action_unit, self.action_unit == ACTION_UNIT, repr(ACTION_UNIT)),
            ("action.meaning", self.action_meaning, self.action_meaning == ACTION_MEANING,
                repr(ACTION_MEANING)),
            ("action.clip", self.action_clip, 0.0 < self.action_clip <= 100.0, "up to 100 rad"),
            *drive_promises(self),
            ("position_loop", self.loop, self.loop is None or self.loop.sound,
                "duty_per_rad above 0, max_duty up to 1, and duty_offset within it"),
            ("pay_out_rad", self.pay_outs, len({each is None for each in self.pay_outs}) == 1,
                "on the card of every servo, or of none"),
            (GOAL_RANGES[self.task], self.goal_range, is_range(self.goal_range),
                "[least, greatest] within 1000"),
            *(() if self.turning is None else self.turning.promises),
            ("normalisation", self.normalisation, self.normalisation in NORMALISATIONS,
                f"one of {', '.join(NORMALISATIONS)}"),
            ("model", self.model, self.model is None or HASH.fullmatch(self.model) is not None,
                "the SHA-256 of a model file, or null"),
        )  # fmt: skip
        refuse_broken(promises, InvalidPolicyFile)
        for place, servo in enumerate(self.further_servos, start=1):
            refuse_broken(drive_promises(servo), InvalidPolicyFile, f" of servo {place}")

    @property
    def task(self) -> Task:
        """What the policy is for."""
        return "tip" if self.turning is None else "turn"

    @property
    def servo_count(self) -> int:
        """Number of servos D that the policy drives."""
        return 1 + len(self.further_servos)

    @property
    def command_ranges(self) -> tuple[tuple[float, float], ...]:
        """Least and greatest desired motor angle of each servo [rad]."""
        return (self.command_range, *(each.command_range for each in self.further_servos))

    @property
    def pay_outs(self) -> tuple[tuple[float, float] | None, ...]:
        """Pay-out rule of each servo [rad], where it has one."""
        return (self.pay_out, *(each.pay_out for each in self.further_servos))

    @property
    def turning_range(self) -> tuple[float, float]:
        """Angles between which commands let the first spool come to rest [rad]."""
        return turning_range(self)

    @property
    def observation_size(self) -> int:
        """Numbers in an observation."""
        return self.history * len(self.observation)

    @property
    def divider(self) -> int:
        """Readings of the servo per policy step."""
        return round(self.servo_rate / self.rate)

    def to_json(self) -> str:
        """Return the card as it stands in a file."""
        table = table_of(self)
        table["action"] = {key: table.pop(f"action_{key}") for key in ("unit", "clip", "meaning")}
        table[GOAL_RANGES[self.task]] = table.pop("goal_range")
        return json.dumps(table | ({} if self.turning is None else {"task": self.task}), indent=1)

    @staticmethod
    def from_json(text: str) -> "PolicyCard":
        """Read and check a card.

        Raises:
            InvalidPolicyFile: The text is no JSON object, or a value is missing or mistyped.
        """
        return read_card_json(text, read_card, {"schema": SCHEMA}, InvalidPolicyFile)


def read_card(table: CheckedTable) -> PolicyCard:
    """Build a card from the table that JSON gives."""
    action = table.table("action")
    goals = GOAL_RANGES["turn" if "turning" in table else "tip"]
    return table.record(
        PolicyCard,
        observation=tuple((name, unit) for name, unit in table.values["observation"]),
        action_unit=action.word("unit"),
        action_clip=action.number("clip"),
        action_meaning=action.word("meaning"),
        goal_range=table.pair(goals) if goals in table else TIP_GOALS,
    )


def drive_promises(servo: PolicyCard | FurtherServo) -> tuple[Promise, ...]:
    """Return what must hold of one servo: a name, what came, whether it holds, what is promised."""
    return (
        (
            "command_range_rad",
            servo.command_range,
            is_range(servo.command_range),
            "[least, greatest] within 1000 rad",
        ),
        (
            "pay_out_rad",
            servo.pay_out,
            is_pay_out(servo),
            "[home, wound in] with home above the least command, by 2 rad at most, and wound in "
            "from there to the greatest one",
        ),
        ("spool_radius_m", servo.spool_radius, 1e-4 <= servo.spool_radius <= 1.0, "1e-4 to 1 m"),
        ("servo", servo.servo, bool(servo.servo), "the name of a servo"),
        ("force_limit_n", servo.force_limit, 0.0 < servo.force_limit <= 1000.0, "up to 1000 N"),
    )


def is_range(values: tuple[float, float]) -> bool:
    """Tell whether two angles are a range that a spool can mean."""
    low, high = values
    return isfinite(low) and isfinite(high) and -1000.0 <= low < high <= 1000.0


def is_pay_out(servo: PolicyCard | FurtherServo) -> bool:
    """Tell whether a servo's pay-out rule, if it has one, lies within its range."""
    if servo.pay_out is None:
        return True
    (least, greatest), (home, wound_in) = servo.command_range, servo.pay_out
    return least < home <= min(wound_in, least + DEEPEST_COMMAND) and wound_in < greatest


def turning_range(servo: PolicyCard | FurtherServo) -> tuple[float, float]:
    """Return the angles between which commands let a spool come to rest [rad]."""
    least, greatest = servo.command_range
    return least if servo.pay_out is None else servo.pay_out[0], greatest

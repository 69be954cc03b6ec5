"""The learning curve: what each iteration of a training brought."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

CURVE_FIGURES = {
    "/tip_error_m": "tip_error",
    "/turning_rate_rad_s": "turning_rate",
    "/displacement_m": "displacement",
    "/drops_per_minute": "drops_per_minute",
}
"""Columns of the curve that not every task has, by what an environment logs."""


@dataclass(frozen=True, kw_only=True)
class CurvePoint:
    """Figures of one iteration."""

    iteration: int  # Number of finished iterations
    samples: int  # Policy steps learned from, in all
    # Means of the task while exploring, by the names of `CURVE_FIGURES`
    figures: Mapping[str, float]
    reward: float  # Mean reward of a step
    action_change: float  # Mean change of the action from step to step, while exploring [rad]
    diverged: int  # Worlds that diverged in this iteration
    value_loss: float
    surrogate_loss: float
    learning_rate: float

    @property
    def tip_error(self) -> float:
        """Mean distance between tip and goal, while exploring [m]."""
        return self.figures["tip_error"]

    @property
    def text(self) -> str:
        """What the policy does, in words."""
        own = self.figures
        if "tip_error" in own:
            return f"tip error {1e3 * self.tip_error:5.1f} mm"
        return (
            f"turning {own['turning_rate']:5.2f} rad/s   {own['drops_per_minute']:4.1f} drops/min"
            f"   {1e3 * own['displacement']:4.1f} mm off"
        )

    def to_row(self) -> dict[str, float]:
        """Return all numbers by the names of the columns; the task's stand behind the samples."""
        table = asdict(self)
        first = {name: table.pop(name) for name in ("iteration", "samples")}
        return {**first, **table.pop("figures"), **table}


@dataclass(frozen=True, kw_only=True)
class Progress:
    """Figures of a training after an iteration."""

    point: CurvePoint
    iterations: int  # Iterations in all
    steps_per_second: float  # Policy steps of all worlds per second
    seconds_left: float  # At this pace [s]

    @property
    def text(self) -> str:
        """The figures as a line."""
        point, left = self.point, self.seconds_left
        time = f"{left:.0f} s" if left < 120.0 else f"{left / 60.0:.0f} min"
        diverged = f"   {point.diverged} worlds diverged" if point.diverged else ""
        return (
            f"iteration {point.iteration:4d} of {self.iterations}   "
            f"{point.text}   reward {point.reward:8.4f}   "
            f"{self.steps_per_second:,.0f} steps/s   {time} left{diverged}"
        )


class CurveLogger:
    """Takes the place of rsl-rl's logger: sums on the device, and one point per iteration.

    Args:
        samples: Policy steps of one iteration, over all processes.
        report: Called with every new point.
        folder: Where the TensorBoard log goes; none for a process that does not write.
    """

    writer = None  # rsl-rl saves only where its logger has one; checkpoints are written here
    log_dir = None

    def __init__(
        self,
        points: Sequence[CurvePoint],
        *,
        iterations: int,
        samples: int,
        report: Callable[[Progress], None],
        folder: Path | None,
    ) -> None:
        self.points = list(points)
        self._iterations = iterations
        self._samples = samples
        self._report = report
        self._folder = folder
        self._board: Any = None
        self._sums: dict[str, Tensor] = {}
        self._steps = 0
        self._started = time.monotonic()
        self._done_before = len(self.points)

    def init_logging_writer(self) -> None:
        """Open the TensorBoard log."""
        if self._folder is not None and self._board is None:
            from torch.utils.tensorboard import SummaryWriter

            # what an interrupted training logged after its last checkpoint is learned again
            self._board = SummaryWriter(str(self._folder), purge_step=len(self.points) + 1)

    def process_env_step(
        self, rewards: Tensor, dones: Tensor, extras: Mapping[str, Any], intrinsic: Any = None
    ) -> None:
        """Add a step of all worlds."""
        for name, value in {"reward": rewards.mean(), **extras["log"]}.items():
            self._sums[name] = self._sums.get(name, torch.zeros_like(value)) + value
        self._steps += 1

    def log(self, *, loss_dict: Mapping[str, float], learning_rate: float, **others: Any) -> None:
        """Turn the sums into a point of the curve."""
        sums = {name: float(value) for name, value in self._sums.items()}
        done = len(self.points) + 1
        point = CurvePoint(
            iteration=done,
            samples=(self.points[-1].samples if self.points else 0) + self._samples,
            figures={
                name: sums[logged] / self._steps
                for logged, name in CURVE_FIGURES.items()
                if logged in sums
            },
            reward=sums["reward"] / self._steps,
            action_change=sums["/action_change_rad"] / self._steps,
            diverged=round(sums["/diverged_worlds"]),
            value_loss=loss_dict["value"],
            surrogate_loss=loss_dict["surrogate"],
            learning_rate=learning_rate,
        )
        self.points.append(point)
        self._sums, self._steps = {}, 0
        if self._board is not None:
            for name, value in point.to_row().items():
                self._board.add_scalar(f"policy/{name}", value, done)
        pace = (time.monotonic() - self._started) / (done - self._done_before)
        self._report(
            Progress(
                point=point,
                iterations=self._iterations,
                steps_per_second=self._samples / pace,
                seconds_left=pace * max(0, self._iterations - done),
            )
        )

    def close(self) -> None:
        """Finish the TensorBoard log."""
        if self._board is not None:
            self._board.close()


def curve_table(points: Sequence[CurvePoint]) -> dict[str, Any]:
    """Return a curve as JSON: the names of its columns, and a row per iteration."""
    rows = [point.to_row() for point in points]
    return {"columns": list(rows[0]) if rows else [], "rows": [list(row.values()) for row in rows]}


def read_curve(table: Mapping[str, Any]) -> list[CurvePoint]:
    """Return the curve that a table holds."""
    points = []
    for values in table["rows"]:
        row = dict(zip(table["columns"], values, strict=True))
        figures = {name: row.pop(name) for name in CURVE_FIGURES.values() if name in row}
        points.append(CurvePoint(figures=figures, **row))
    return points

"""A fitted number with its interval, and a bench as it was set up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from tendon_newton.data.bench_overrides import BenchOverrides, write_bench_overrides
from tendon_newton.data.recording import Recording


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """One fitted number."""

    value: float
    ci95: tuple[float, float]  # 95 % interval, from the scatter between blocks of time
    unit: str
    at_bound: bool = False  # Whether the fit ended at the edge of the parameter's range
    flat: bool = False
    """Whether the interval is as wide as the range: the data say nothing about it."""
    null: float | None = None
    """Value that means nothing, the range's end where none is infinite [unit]; None for a shape."""

    def to_json(self) -> dict[str, Any]:
        """Return it for ``diagnosis.json``; what is not the case is left out."""
        out: dict[str, Any] = {
            "value": self.value, "ci95": list(self.ci95), "unit": self.unit, "null": self.null,
        }  # fmt: skip
        out |= {key: True for key in ("at_bound", "flat") if getattr(self, key)}
        return out


@dataclass(frozen=True, kw_only=True)
class Setting:
    """A bench as it was set up, and for how long it was recorded so."""

    bench: str
    seconds: float = 0.0  # Training data from it [s]; none where a run is only thought of
    bench_overrides: BenchOverrides = field(default_factory=BenchOverrides)
    actuator_overrides: Mapping[str, float] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return it as ``dataset.toml`` names it, with the seconds."""
        out: dict[str, Any] = {"bench": self.bench, "seconds": round(self.seconds, 3)}
        if overrides := write_bench_overrides(self.bench_overrides):
            out["bench_overrides"] = overrides
        if self.actuator_overrides:
            out["actuator_overrides"] = dict(self.actuator_overrides)
        return out

    def same_bench(self, other: Setting) -> bool:
        """Tell whether another setting differs in time alone."""
        return (self.bench, self.bench_overrides, self.actuator_overrides) == (
            other.bench,
            other.bench_overrides,
            other.actuator_overrides,
        )


def settings_of(recordings: Sequence[Recording]) -> tuple[Setting, ...]:
    """Return each way in which the benches were set up once, with the time recorded so."""
    found: list[Setting] = []
    for r in recordings:
        new = Setting(
            bench=r.bench,
            seconds=r.duration,
            bench_overrides=r.bench_overrides,
            actuator_overrides=dict(r.actuator_overrides),
        )
        same = next((old for old in found if old.same_bench(new)), None)
        if same is not None:
            found.remove(same)
            new = replace(new, seconds=same.seconds + new.seconds)
        found.append(new)
    return tuple(found)

"""Measured and simulated signals of the held-out recordings, as a report shows them."""

from dataclasses import dataclass

import numpy as np

from tendon_newton.data.recording import Array, Mask, Recording
from tendon_newton.data.root_mean_square import rms
from tendon_newton.diagnosis.diagnose import Evidence
from tendon_newton.identification.study import replacements

WINDOW = 4.0  # Length of the window that is shown of a recording [s]
MOST_WINDOWS = 3  # Benches that are shown
GAP_STEPS = 3.0  # A step of time longer than this many typical ones interrupts a line


@dataclass(frozen=True, kw_only=True)
class HeldOutComparison:
    """One held-out recording beside the two models."""

    recording: Recording
    theta: Array
    """Residual of the motor angle [rad] before and after, shape (2, T); NaN where no model can know
    it, as after a gap in which the command jumped."""
    force: Array | None  # Residual of the tension [N] before and after; None without a load cell

    @property
    def time(self) -> Array:
        """Time since the first row [s], shape (T,)."""
        return self.recording.time - self.recording.time[0]

    def residual(self, signal: str) -> Array | None:
        """Return the residuals of ``theta`` or ``force``."""
        return self.theta if signal == "theta" else self.force

    def measured(self, signal: str) -> Array:
        """Return what was measured of a signal, shape (T,)."""
        if signal == "theta":
            return self.recording.compared_angle
        assert self.recording.force is not None
        return self.recording.force[:, 0]


@dataclass(frozen=True, kw_only=True)
class Window:
    """A few telling seconds of a recording."""

    comparison: HeldOutComparison
    start: float  # Since the recording's first row [s]

    @property
    def rows(self) -> Mask:
        """Rows inside, shape (T,)."""
        time = self.comparison.time
        return (time >= self.start) & (time <= self.start + WINDOW)


def compare(evidence: Evidence) -> tuple[HeldOutComparison, ...]:
    """Simulate the held-out recordings with the starting and the extended model."""
    study = evidence.test
    residuals = study.residuals(*replacements((evidence.baseline, evidence.extended)))
    return tuple(
        HeldOutComparison(
            recording=study.recordings[k],
            theta=np.where(own.trusted, own.theta, np.nan),
            force=None if own.force is None else np.where(own.trusted, own.force, np.nan),
        )
        for k in range(len(study.recordings))
        for own in (residuals[k],)
    )


def telling_windows(comparisons: tuple[HeldOutComparison, ...], *, gap: bool) -> tuple[Window, ...]:
    """Choose a window per bench: where the starting model errs most, or else most moves."""
    sizes = {s: pooled_rms(comparisons, s, 0) or 1.0 for s in ("theta", "force")}
    best: dict[str, tuple[float, Window]] = {}
    for comparison in comparisons:
        weight = (
            row_weights(comparison, sizes)
            if gap
            else comparison.recording.motor_velocity[:, 0] ** 2
        )
        score, start = busiest_window(comparison.time, weight)
        bench = comparison.recording.bench
        if bench not in best or score > best[bench][0]:
            best[bench] = (score, Window(comparison=comparison, start=start))
    ranked = sorted(best.values(), key=lambda entry: -entry[0])
    return tuple(window for _, window in ranked[:MOST_WINDOWS])


def row_weights(comparison: HeldOutComparison, sizes: dict[str, float]) -> Array:
    """Return each row's squared error before, signals counting alike, shape (T,)."""
    weight = (comparison.theta[0] / sizes["theta"]) ** 2
    if comparison.force is not None:
        weight = weight + (comparison.force[0] / sizes["force"]) ** 2
    return np.nan_to_num(weight)


def busiest_window(time: Array, weight: Array) -> tuple[float, float]:
    """Return (weight inside, start [s]) of the window with the greatest weight."""
    total = np.concatenate([[0.0], np.cumsum(weight)])
    inside = total[np.searchsorted(time, time + WINDOW, side="right")] - total[:-1]
    whole = time <= max(time[-1] - WINDOW, 0.0)
    k = int(np.argmax(np.where(whole, inside, -1.0)))
    return float(inside[k]), float(time[k])


def pooled(comparisons: tuple[HeldOutComparison, ...], signal: str, which: int) -> Array:
    """Return the residuals of all recordings in one array; empty without the signal."""
    parts = [r[which] for c in comparisons if (r := c.residual(signal)) is not None]
    values = np.concatenate(parts) if parts else np.zeros(0)
    return values[~np.isnan(values)]


def pooled_rms(comparisons: tuple[HeldOutComparison, ...], signal: str, which: int) -> float:
    """Return the root mean square over all rows of all recordings."""
    values = pooled(comparisons, signal, which)
    return rms(values) if len(values) else 0.0


def broken_at_gaps(time: Array, values: Array) -> tuple[Array, Array]:
    """Return a line that is interrupted where rows are missing."""
    steps = np.diff(time)
    if not len(steps):
        return time, values
    gaps = np.flatnonzero(steps > GAP_STEPS * np.median(steps)) + 1
    return np.insert(time, gaps, np.nan), np.insert(values, gaps, np.nan)

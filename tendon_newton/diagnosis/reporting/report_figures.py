"""The pictures of a report, one panel each."""

from typing import Any

import numpy as np

from tendon_newton.data.plain_numbers import number
from tendon_newton.diagnosis.reporting.held_out import (
    HeldOutComparison,
    Window,
    broken_at_gaps,
    pooled,
    pooled_rms,
)
from tendon_newton.diagnosis.reporting.inline_svg import AFTER, BEFORE, FAINT, GREY, INK, svg
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.diagnosis.unexplained.remainder import side_words
from tendon_newton.diagnosis.unexplained.remainder_structure import Profile, RemainderStructure

PANEL = (4.6, 2.5)  # Width and height of a panel [inch]
SIGNALS = ("theta", "force")
AXES = {
    "theta": "motor angle [rad]",
    "theta_dot": "motor speed [rad/s]",
    "theta_d": "commanded angle [rad]",
    "t": "time since the start [s]",
    "time_since_reversal": "time since the motion turned round [s]",
    "theta_d_change": "change of the command within 0.1 s [rad]",
    "temperature": "temperature [°C]",
    "voltage": "supply voltage [V]",
}
BARS = 12  # Candidates that the ranking shows


class Panels:
    """Draws the panels of one report."""

    def __init__(self, diagnosis: Diagnosis, comparisons: tuple[HeldOutComparison, ...]) -> None:
        self.diagnosis = diagnosis
        self.comparisons = comparisons
        self.changed = bool(diagnosis.effects)
        self.floors = {"theta": diagnosis.noise_theta, "force": diagnosis.noise_force}
        self.curves = (
            [(0, BEFORE, "starting model"), (1, AFTER, "with the causes named")]
            if self.changed
            else [(0, BEFORE, "model")]
        )
        self.signals = [s for s in ("theta", "force") if pooled(comparisons, s, 0).any()]

    def unit(self, signal: str) -> tuple[float, str]:
        """Return what a residual is multiplied with, and its unit then."""
        return (1.0, self.diagnosis.scale.force_unit) if signal == "force" else (1e3, "mrad")

    def name(self, signal: str) -> str:
        """Name what was measured."""
        return self.diagnosis.scale.force_name if signal == "force" else "motor angle"

    def axis(self, signal: str) -> str:
        """Label an axis with a signal."""
        scale = self.diagnosis.scale
        own = {
            "force": f"{scale.force_name} [{scale.force_unit}]",
            "force_change": f"change of the modelled force within 0.1 s [{scale.force_unit}]",
        }
        return own.get(signal) or AXES.get(signal, signal)

    def before(self, signal: str) -> float:
        """Return the starting model's pooled error, one where there is none."""
        return pooled_rms(self.comparisons, signal, 0) or 1.0

    def window(self, name: str, window: Window, signal: str) -> str:
        """Draw measured and simulated signal over a few seconds."""
        c, rows = window.comparison, window.rows
        residual = c.residual(signal)
        assert residual is not None

        def draw(axes: Any) -> None:
            time = c.time[rows]
            axes.plot(
                *broken_at_gaps(time, c.measured(signal)[rows]),
                color=INK,
                linewidth=4.0,
                alpha=0.4,
                label="measured",
            )
            for which, color, label in self.curves:
                simulated = (c.measured(signal) - residual[which])[rows]
                axes.plot(
                    *broken_at_gaps(time, simulated),
                    color=color,
                    label=label,
                    linestyle=("--", "-")[which],
                    linewidth=1.5,
                )
            axes.set_xlabel("time [s]")
            axes.set_ylabel(self.axis(signal))
            axes.margins(x=0.0)

        return svg(
            name, f"{self.name(signal)} of {c.recording.name}, measured and simulated", PANEL, draw
        )

    def residual_trace(self, name: str, comparison: HeldOutComparison, signal: str) -> str:
        """Draw a whole recording's residual against the noise floor."""
        scale, unit = self.unit(signal)
        residual = comparison.residual(signal)
        assert residual is not None

        def draw(axes: Any) -> None:
            self._floor(axes.axhspan, signal, scale)
            for which, color, _ in self.curves:
                axes.plot(
                    *broken_at_gaps(comparison.time, scale * residual[which]),
                    color=color,
                    linewidth=1.0,
                )
            axes.set_xlabel("time [s]")
            axes.set_ylabel(f"{self.name(signal)},\nmeasured − simulated [{unit}]")
            axes.margins(x=0.0)

        return svg(
            name,
            f"residual of the {self.name(signal)} over time, {comparison.recording.name}",
            PANEL,
            draw,
        )

    def residual_spread(self, name: str, signal: str) -> str:
        """Draw how often each size of residual occurs, sizes in equal ratios."""
        scale, unit = self.unit(signal)
        sizes = [np.abs(scale * pooled(self.comparisons, signal, w)) for w, _, _ in self.curves]
        floor = scale * (self.floors[signal] or 0.0)
        largest = max(float(np.max(size)) for size in sizes)
        least = min(0.05 * floor if floor else 1e-3 * largest, 0.1 * largest)
        edges = np.geomspace(least, largest, 40)

        def draw(axes: Any) -> None:
            if floor:
                axes.axvspan(least, 2.0 * floor, color=GREY, alpha=0.25, linewidth=0.0)
            for (_, color, _), size in zip(self.curves, sizes, strict=True):
                share = 100.0 * np.histogram(size, edges)[0] / len(size)
                axes.stairs(share, edges, color=color, linewidth=1.4)
                axes.stairs(share, edges, color=color, fill=True, alpha=0.2)
            axes.set_xscale("log")
            axes.xaxis.set_major_formatter(plain_tick)
            axes.margins(x=0.0)
            axes.set_xlabel(f"{self.name(signal)}, size of the error [{unit}]")
            axes.set_ylabel("rows [%]")

        return svg(name, f"sizes of the error of the {self.name(signal)}", PANEL, draw)

    def _floor(self, span: Any, signal: str, scale: float) -> None:
        floor = self.floors[signal]
        if floor:
            span(-2.0 * scale * floor, 2.0 * scale * floor, color=GREY, alpha=0.25, linewidth=0.0)

    def errors(self, name: str, signal: str) -> str:
        """Draw the error of each held-out recording and of all together."""
        scale, unit = self.unit(signal)
        shown = [c for c in self.comparisons if c.residual(signal) is not None]
        groups = [*((c.recording.name, (c,)) for c in shown), ("all", tuple(shown))]

        def draw(axes: Any) -> None:
            height = 0.8 / len(self.curves)
            for row, (_, members) in enumerate(groups):
                for which, color, _ in self.curves:
                    value = scale * pooled_rms(members, signal, which)
                    y = row + height * (which - 0.5 * (len(self.curves) - 1))
                    axes.barh(y, value, height=0.92 * height, color=color)
                    axes.annotate(
                        number(value),
                        (value, y),
                        xytext=(3, 0),
                        va="center",
                        textcoords="offset points",
                        fontsize=8,
                    )
            if floor := self.floors[signal]:
                axes.axvline(scale * floor, color=INK, linestyle=":", linewidth=1.4)
            axes.set_yticks(range(len(groups)), [short(label) for label, _ in groups])
            axes.invert_yaxis()
            axes.margins(x=0.18)
            axes.grid(visible=False, axis="y")
            axes.set_xlabel(f"{self.name(signal)}, RMS error [{unit}]; dotted: noise floor")

        size = (PANEL[0], 0.9 + 0.42 * len(groups))
        return svg(name, f"RMS error of the {self.name(signal)} by held-out recording", size, draw)

    def ranking(self, name: str) -> str:
        """Draw the score of each candidate alone; a bracket joins those not told apart."""
        named = [effect.name for effect in self.diagnosis.effects]
        rivals = {e.name: e.indistinguishable_from for e in self.diagnosis.effects}
        kept = {*named, *(r for group in rivals.values() for r in group)}
        ranked = sorted(self.diagnosis.candidates, key=lambda c: -c.score)
        rows = [c for k, c in enumerate(ranked) if k < BARS or c.name in kept]
        place = {c.name: k for k, c in enumerate(rows)}

        def draw(axes: Any) -> None:
            for k, candidate in enumerate(rows):
                share = max(-10.0, 100.0 * candidate.score)
                axes.barh(k, share, color=AFTER if candidate.name in named else FAINT, height=0.72)
                shown = f"{round(share)}".replace("-", "−")
                axes.annotate(
                    shown,
                    (max(share, 0.0), k),
                    xytext=(3, 0),
                    va="center",
                    textcoords="offset points",
                    fontsize=8,
                )
            for k, (effect, others) in enumerate(rivals.items()):
                bracket(
                    axes, sorted(place[n] for n in (effect, *others) if n in place), 120.0 + 6.0 * k
                )
            labels = [c.name.replace("_", " ") + " (at its bound)" * bool(c.at_bound) for c in rows]
            axes.set_yticks(range(len(rows)), labels)
            for tick, candidate in zip(axes.get_yticklabels(), rows, strict=True):
                tick.set_fontweight("bold" if candidate.name in named else "normal")
            axes.invert_yaxis()
            axes.set_xlim(right=118.0 + 6.0 * max(1, len(rivals)))
            axes.set_xticks([0, 25, 50, 75, 100])
            axes.grid(visible=False, axis="y")
            axes.set_xlabel("share of the gap that it removes alone [%]")

        return svg(name, "candidate causes by score", (PANEL[0], 0.7 + 0.22 * len(rows)), draw)

    def remainder(self, name: str, structure: RemainderStructure, profile: Profile) -> str:
        """Draw the mean of what remains where a signal has some value, and what was learned."""
        what, unit = side_words(structure.side, structure.scale)
        scale, shown = (1e3, "mrad") if unit == "rad" else (1.0, unit)

        def draw(axes: Any) -> None:
            axes.errorbar(
                profile.center,
                scale * profile.mean,
                scale * profile.error,
                fmt="o",
                color=INK,
                markersize=3.5,
                elinewidth=1.0,
                label="measured, 95 %",
            )
            axes.plot(profile.center, scale * profile.learned, color=AFTER, label="learned")
            axes.axhline(0.0, color=GREY, linewidth=0.8)
            axes.set_xlabel(self.axis(profile.signal))
            axes.set_ylabel(f"{what},\nmeasured − modelled [{shown}]", fontsize=8)

        return svg(name, f"{what}: what remains against {profile.signal}", PANEL, draw)


def bracket(axes: Any, rows: list[int], x: float) -> None:
    """Tie bars together that the data cannot tell apart."""
    if len(rows) < 2:
        return
    axes.plot([x, x], [rows[0], rows[-1]], color=INK, linewidth=1.2)
    for row in rows:
        axes.plot([x - 2.5, x], [row, row], color=INK, linewidth=1.2)


def full_name(name: str) -> str:
    """Return a recording's name without its ending, with its servo where there are several."""
    file, comma, servo = name.rsplit("/", 1)[-1].partition(", ")
    return file.rsplit(".", 1)[0].replace("_", " ") + comma + servo


def short(name: str) -> str:
    """Return a recording's name, no longer than an axis can hold."""
    stem = full_name(name)
    return stem if len(stem) <= 22 else f"{stem[:10]}…{stem[-11:]}"


def plain_tick(value: float, _place: int) -> str:
    """Return the label of a tick."""
    return f"{value:g}"

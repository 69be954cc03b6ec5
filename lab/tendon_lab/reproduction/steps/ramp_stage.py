"""The paper's open-loop ramp: measured force, ideal force, the gap, and the neglected inertia."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from tendon_lab.force_scoring.ideal_baseline import PAPER_GAIN, ideal_force
from tendon_lab.reproduction.outcome import Figure, Outcome, row
from tendon_lab.reproduction.physical import DATA_SHEET, SPOOL_RADIUS
from tendon_lab.reproduction.reproduction import Reproduction
from tendon_lab.reproduction.unit import Unit
from tendon_newton.data.files.picture import GREY, INK, new_figure, save, tidy
from tendon_newton.data.recording import Array, Recording
from tendon_newton.data.root_mean_square import rms
from tendon_train.actuator.training_config import SERVO_LIMIT

BENCH, KIND = "spring_strong", "contact_ramp"
LOAD = 0.05  # Mass of the carriage [kg]
SMOOTHING = 0.1  # Time over which an angle is fitted by a parabola for its acceleration [s]
ROTOR = float(DATA_SHEET["armature"])
FIGURE = "ramp.png"


@dataclass(frozen=True, kw_only=True)
class Ramp:
    """A ramp and what the ideal source makes of its signals, shapes (T,)."""

    recording: Recording
    measured: Array  # [N]
    ideal: Array  # P = 4.2 N/rad [N]
    refitted: Array  # P refitted [N]
    inertia: Array  # m_eff x'' [N]


async def run(reproduction: Reproduction) -> Outcome:
    """Measure the gap on every bench and draw it on the first."""
    found = await reproduction.each(measured, range(len(reproduction.units)))
    gaps, refitted, inertia = (list(values) for values in zip(*found, strict=True))
    shares = [100.0 * i / g for i, g in zip(inertia, gaps, strict=True)]
    where = "ramp of 1.5 rad/s, strong spring"
    return Outcome(
        rows=(
            row(
                where,
                "gap of the ideal force, 4.2 N/rad, RMS",
                "N",
                gaps,
                differs="the paper shows it, without a number",
            ),
            row(where, "gap of the ideal force, P refitted, RMS", "N", refitted),
            row(
                where,
                "neglected m_eff x'', RMS",
                "N",
                inertia,
                differs="the paper assumes that it is small",
            ),
            row(where, "neglected m_eff x'' over the gap, RMS", "%", shares),
        ),
        numbers={"gap_n": gaps, "refitted_gap_n": refitted, "inertia_n": inertia},
        figures=(
            Figure(
                file=FIGURE,
                caption=f"Ramp of 1.5 rad/s up and down on the strong spring, "
                f"{reproduction.units[0].name}. {reproduction.caption}",
            ),
        ),
    )


def measured(reproduction: Reproduction, place: int) -> tuple[float, float, float]:
    """Draw the first bench's ramp, and return one bench's gaps and the neglected force, RMS [N]."""
    ramp = ramp_of(reproduction, reproduction.units[place])
    if place == 0:
        draw(ramp, reproduction, FIGURE)
    gaps = (ramp.measured - ramp.ideal, ramp.measured - ramp.refitted, ramp.inertia)
    gap, refitted, inertia = map(rms, gaps)
    return gap, refitted, inertia


def ramp_of(reproduction: Reproduction, unit: Unit) -> Ramp:
    """Return one bench's ramp."""
    recording = unit.find(BENCH, KIND)
    assert recording.force is not None
    gain = float(reproduction.model(unit, "ideal_refitted").actuator.values["gain"])
    return Ramp(
        recording=recording,
        measured=recording.force[:, 0],
        ideal=ideal_force(recording, 0, PAPER_GAIN, SERVO_LIMIT),
        refitted=ideal_force(recording, 0, gain, SERVO_LIMIT),
        inertia=(ROTOR / SPOOL_RADIUS**2 + LOAD) * SPOOL_RADIUS * acceleration(recording),
    )


def acceleration(recording: Recording) -> Array:
    """Return the motor's acceleration [rad/s2] at every row, shape (T,)."""
    from scipy.signal import savgol_filter

    step = float(np.median(np.diff(recording.time)))
    rows = 2 * round(SMOOTHING / step / 2.0) + 1
    angle = recording.motor_position[:, 0]
    return np.asarray(savgol_filter(angle, rows, 2, deriv=2, delta=step), dtype=np.float64)


def draw(ramp: Ramp, reproduction: Reproduction, name: str) -> None:
    """Draw angles, forces and what is left."""
    figure: Any = new_figure(8.0, 7.0)
    angle, force, rest = figure.subplots(3, 1, sharex=True, height_ratios=[1, 1.4, 1.2])
    time = ramp.recording.time - ramp.recording.time[0]
    assert ramp.recording.command is not None
    angle.step(time, ramp.recording.command[:, 0], where="post", color=GREY, label="commanded")
    angle.plot(time, ramp.recording.motor_position[:, 0], color=INK, label="measured")
    force.plot(time, ramp.measured, color=INK, label="measured")
    force.plot(time, ramp.ideal, color="#d1495b", label="ideal, P = 4.2 N/rad")
    force.plot(time, ramp.refitted, color="#d1495b", linestyle="--", label="ideal, P refitted")
    rest.plot(time, ramp.measured - ramp.ideal, color="#d1495b", label="measured less ideal")
    rest.plot(time, ramp.inertia, color="#1764ab", label="neglected m_eff x''")
    for axes, label in ((angle, "angle [rad]"), (force, "tension [N]"), (rest, "gap [N]")):
        axes.set_ylabel(label)
        axes.legend(frameon=False, fontsize=8)
        tidy(axes)
    rest.set_xlabel("time [s]")
    save(figure, reproduction.folder("figures") / name)

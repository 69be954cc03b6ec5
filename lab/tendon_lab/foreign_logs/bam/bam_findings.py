"""What the registers of a servo tell about its own logs."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.importers.imported import ImportedLog
from tendon_newton.data.recording import Array, Recording
from tendon_newton.data.root_mean_square import rms

DUTY_BANDS = ((0.0, 0.05), (0.2, 0.9), (0.99, 1.01))  # [1] at rest, switching, fully on
ROWS_FOR_A_BAND = 20  # fewer rows give no scatter worth a number
LATENCIES = np.arange(0.0, 0.0101, 0.0005)  # [s] two rows at 190 Hz
COUNT = 1.0 / 885.0  # [1] resolution of the duty


def log_findings(log: ImportedLog, wraps: Mapping[str, int]) -> list[Finding]:
    """Say what stands out in one log.

    Args:
        log: The log.
        wraps: Rows of ``load`` and ``speed`` that held a negative value as an unsigned one.
    """
    recording = log.recording
    found = [
        Examined(recording.name, channel).caution(
            f"{count} of {recording.sample_count} rows of the source held negative "
            "values read as unsigned 16-bit counts",
            "unwrapped on import; whoever reads the source must do so too",
        )
        for channel, count in (("duty", wraps.get("load", 0)), ("theta_dot", wraps.get("speed", 0)))
        if count
    ]
    if "duty" not in recording.extra:
        return found
    return [*found, *duty_law(recording), *supply_and_duty(recording)]


def duty_law(recording: Recording) -> Iterator[Finding]:
    """Compare the logged duty with the position loop that the firmware documents."""
    assert recording.command is not None
    duty, powered = recording.extra["duty"], recording.enabled
    gain = recording.actuator_overrides["duty_per_rad"]
    goal, theta = recording.command[:, 0], recording.motor_position[:, 0]

    def misfit(latency: float) -> float:
        late = np.interp(recording.time - latency, recording.time, goal)
        law = np.clip(gain * (late - theta), -1.0, 1.0)
        return rms((law - duty)[powered])

    if not powered.any():
        return
    scores = [misfit(latency) for latency in LATENCIES]
    best = int(np.argmin(scores))
    yield Examined(recording.name, "duty").note(
        f"follows duty_per_rad (theta_d - theta) within {scores[0] / COUNT:.1f} counts "
        f"rms, {scores[best] / COUNT:.1f} with theta_d {1e3 * LATENCIES[best]:.1f} ms late",
        "the loop is the documented one; a command acts about that much after its row",
    )


def supply_and_duty(recording: Recording) -> Iterator[Finding]:
    """Scatter of the supply register by duty: switching makes it, not the supply."""
    voltage = recording.voltage
    if voltage is None:
        return
    duty = np.abs(recording.extra["duty"])
    parts: list[str] = []
    for lower, upper in DUTY_BANDS:
        band: Array = voltage[(duty >= lower) & (duty < upper)]
        if band.size >= ROWS_FOR_A_BAND:
            parts.append(f"{band.mean():.2f} +- {band.std():.2f} V at duty {lower:g}-{upper:g}")
    if len(parts) > 1:
        yield Examined(recording.name, "voltage").note(
            "; ".join(parts).replace("0.99-1.01", "1"),
            "where it scatters only while the bridge switches, the register samples "
            "ripple; the sag is the mean at full duty against the mean at rest",
        )


def dataset_findings(logs: Sequence[ImportedLog]) -> tuple[Finding, ...]:
    """Say what the files as a whole leave out or contradict."""
    return (*arm_findings(logs), *supply_findings(logs))


def supply_findings(logs: Sequence[ImportedLog]) -> Iterator[Finding]:
    """Compare the supply that was stated with the one that was measured."""
    means = [
        float(log.recording.voltage.mean()) for log in logs if log.recording.voltage is not None
    ]
    stated = sorted({float(log.conditions["vin"]) for log in logs})
    if means:
        yield Examined("all", "voltage").note(
            f"stated {', '.join(f'{value:g}' for value in stated)} V; measured means "
            f"{min(means):.2f}-{max(means):.2f} V",
            "the measured supply is the one that drives the motor",
        )


def arm_findings(logs: Sequence[ImportedLog]) -> Iterator[Finding]:
    """Say what the arm weighs, or that nobody does."""
    masses = [log.conditions["arm_mass"] for log in logs if "arm_mass" in log.conditions]
    if not masses:
        yield Examined("all", "mass").caution(
            "the arm's own mass is not logged, only that of the weight at its end",
            "inertia and gravity torque are somewhat larger than the bench says; logs "
            "with several loads tell it, and the model then has arm_mass among its unknown numbers",
        )
    elif any(masses):
        yield Examined("all", "mass").note(
            f"the arm weighs {', '.join(str(mass) for mass in dict.fromkeys(masses))} kg",
            "an even arm: half of it counts for gravity at the arm's length, a third for inertia",
        )

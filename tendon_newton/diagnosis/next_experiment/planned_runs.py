"""Runs that are only planned: where, which servo moves, and by which command."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.excitations import EXCITATIONS, excite
from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.identification.study import Residual, Study, replacements
from tendon_newton.mechanisms.loading import load_mechanism

DURATION = 12.0  # Length of a proposed run [s]
TENDON_BENCHES = ("finger", "spring_weak", "spring_strong")
"""Benches on which a run may be proposed for a servo with a tendon; a direct drive stays put."""
OTHER_MASSES = (0.5, 2.0)
"""Factors on the mass of a direct drive: with one load, gravity and what load does look alike."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Command to record, and the bench for it."""

    setting: Setting
    excitation: str
    time: Array  # [s], shape (T,)
    command: Array  # Of the servo that moves [rad], shape (T,)
    servo: int = 0  # The servo that moves; the others hold at 0
    servos: int = 1  # Servos D of the bench

    @property
    def commands(self) -> Array:
        """Commands of all servos [rad], shape (T, D)."""
        out = np.zeros((len(self.command), self.servos))
        out[:, self.servo] = self.command
        return out

    @property
    def place(self) -> str:
        """Bench, with its load where that is told, and the servo that moves, of several."""
        moving = f", servo {self.servo} moving" if self.servos > 1 else ""
        return f"{bench_text(self.setting)}{moving}"

    @property
    def duration(self) -> float:
        """Length [s], to the end of the last row."""
        return round(float(2.0 * self.time[-1] - self.time[-2]), 6)


def library_plans(settings: Sequence[Setting], seeds: Sequence[int], duration: float) -> list[Plan]:
    """Draw runs of every excitation of the library on every bench: each servo moves in turn."""
    return [
        plan_run(setting, name, seed, duration, servo, servos)
        for setting, servo, servos in servos_of(settings)
        for name in EXCITATIONS
        for seed in seeds
    ]


def servos_of(settings: Sequence[Setting]) -> list[tuple[Setting, int, int]]:
    """Return each bench with each of its servos, and how many they are."""
    counts = [len(load_mechanism(setting.bench).tendons) for setting in settings]
    return [(s, servo, n) for s, n in zip(settings, counts, strict=True) for servo in range(n)]


def by_run(study: Study, models: Sequence[Mapping[int, float]]) -> list[Residual]:
    """Simulate models and return the residuals of each run, those of its servos side by side."""
    found, count = study.residuals(*replacements(models)), study.servos
    if count == 1:
        return found
    out: list[Residual] = []
    for first in range(0, len(found), count):
        own = found[first : first + count]
        signals = {name: np.concatenate([r.signals[name] for r in own], axis=2)
                   for name in own[0].signals}  # fmt: skip
        trusted = np.concatenate([r.trusted for r in own])
        out.append(Residual(signals=signals, trusted=trusted))
    return out


def settings_to_try(
    recorded: Sequence[Setting], benches: Sequence[str] | None
) -> tuple[Setting, ...]:
    """Return benches as they were set up, and others on which the same servo can be tried."""
    own = {setting.bench: replace(setting, seconds=0.0) for setting in recorded}
    found = [replace(setting, seconds=0.0) for setting in recorded]
    if set(own) <= set(TENDON_BENCHES):
        found += [Setting(bench=name) for name in TENDON_BENCHES if name not in own]
    else:
        found += [heavier for setting in recorded for heavier in other_masses(setting)]
    if benches is None:
        return tuple(found)
    new = [Setting(bench=name) for name in benches if name not in {s.bench for s in found}]
    return (*(setting for setting in found if setting.bench in benches), *new)


def other_masses(setting: Setting) -> list[Setting]:
    """Return a bench with other loads, where the data say how heavy its own is."""
    mass = setting.bench_overrides.mass
    if mass is None:
        return []
    return [
        replace(
            setting,
            seconds=0.0,
            bench_overrides=BenchOverrides(
                **{**setting.bench_overrides.given, "mass": tuple(factor * m for m in mass)}
            ),
        )
        for factor in OTHER_MASSES
    ]


def bench_text(setting: Setting) -> str:
    """Name a bench, with its load where that is told."""
    mass = setting.bench_overrides.mass
    load = "" if mass is None else f" with {' and '.join(f'{m:.3g}' for m in mass)} kg"
    return f"{setting.bench}{load}"


def plan_run(
    setting: Setting, excitation: str, seed: int, duration: float, servo: int = 0, servos: int = 1
) -> Plan:
    """Draw one run of an excitation; its command stays inside the servo's range."""
    time, command = excite(excitation, duration, np.random.default_rng(seed))
    return Plan(
        setting=setting, excitation=excitation, time=time, command=command,
        servo=servo, servos=servos,
    )  # fmt: skip


def blank_recording(plan: Plan, has_force: bool) -> Recording:
    """Return a recording that has commands and, in place of measurements, zeros."""
    blank = np.zeros((len(plan.time), plan.servos))
    return Recording(
        name=plan.excitation,
        bench=plan.setting.bench,
        time=plan.time,
        command=plan.commands,
        motor_position=blank,
        motor_velocity=blank,
        force=blank if has_force else None,
        bench_overrides=plan.setting.bench_overrides,
        actuator_overrides=plan.setting.actuator_overrides,
    )

"""Which effects of an STS3215 hold on masses, arms and gains that no fit has seen?

``python lab/studies/sts3215.py LOGS`` with raw pendulum logs of kscalelabs/sysid, named
``m<grams>_l<mm>_kp<gain>_<trajectory>_<repeat>.json``. Each model of a list is fitted to the
training logs and scored on conditions that are left out whole, one after the other, all from the
training logs. The model with the fewest numbers within one standard error of the best is then
tested on the rest.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tendon_lab.foreign_logs.bam import read_bam
from tendon_newton.data.importers.imported import ImportedLog
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.search.fixed_set import fit_set
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.identification.study import Study

TERMS: dict[str, dict[str, float]] = {
    "command_delay": {"delay": 0.02},
    "viscous_friction": {"coefficient": 0.02},
    "coulomb_friction": {"force": 0.1},
    "load_dependent_friction": {"coefficient": 0.1},
    "gear_load_friction": {"coefficient": 0.05},
    "stribeck_friction": {"coulomb_force": 0.1, "static_force": 0.12, "stribeck_velocity": 1.0},
    "load_stribeck_friction": {
        "coefficient": 0.05, "static_coefficient": 0.06, "stribeck_velocity": 1.0,
    },
    "asymmetric_friction": {"winding": 0.1, "unwinding": 0.1},
    "holding_friction": {"share": 0.1},
    "hysteresis": {"force": 0.05, "travel": 0.02},
    "gravity_misalignment": {"angle": 0.0},
    "position_offset": {"angle": 0.0},
    "torque_fade": {"fade": 0.02, "time_constant": 1.0},
    "voltage_sag": {"sag": 0.01},
    "actuator_lag": {"time_constant": 0.003},
    "inertia_error": {"scale": 1.0},
}  # fmt: skip
"""Effects that may be fitted, and where their numbers begin [their units, on a shaft]."""
PLAIN = ("command_delay", "viscous_friction", "coulomb_friction")
LOADED = (*PLAIN, "load_dependent_friction")
MODELS: dict[str, tuple[str, ...]] = {
    "delay, viscous": ("command_delay", "viscous_friction"),
    "+ Coulomb": PLAIN,
    "+ Coulomb, Stribeck": ("command_delay", "viscous_friction", "stribeck_friction"),
    "+ Coulomb of two sides": ("command_delay", "viscous_friction", "asymmetric_friction"),
    "+ Coulomb, holding": (*PLAIN, "holding_friction"),
    "+ Coulomb, gear load": (*PLAIN, "gear_load_friction"),
    "+ Coulomb, load": LOADED,
    "+ Coulomb, load with breakaway": (*PLAIN, "load_stribeck_friction"),
    "+ Coulomb, load, fade": (*LOADED, "torque_fade"),
    "+ Coulomb, load, sag": (*LOADED, "voltage_sag"),
    "+ Coulomb, load, lag": (*LOADED, "actuator_lag"),
    "+ Coulomb, load, tilt": (*LOADED, "gravity_misalignment"),
    "+ Coulomb, load, offset": (*LOADED, "position_offset"),
    "+ Coulomb, load, hysteresis": (*LOADED, "hysteresis"),
}
"""Models that are compared, named before any was tested."""
MOTOR = ("torque_constant", "resistance", "armature")
STEP = 5.0e-4  # Simulation step [s]


@dataclass(frozen=True, kw_only=True)
class Split:
    """Logs to fit and logs to test."""

    name: str
    train: Callable[[ImportedLog], bool]  # Which logs are fitted; all others are tested
    groups: Callable[[ImportedLog], tuple[object, ...]]
    """Conditions of a training log, each of which is left out whole in turn."""


def arm(log: ImportedLog) -> tuple[object, object]:
    """Return the mass [kg] and the arm [m] of a log."""
    return log.conditions["mass"], log.conditions["length"]


def gain(log: ImportedLog) -> float:
    """Return the position gain of a log in firmware units."""
    return float(log.conditions["kp"])


SPLITS = {
    "gains": Split(
        name="fitted at gains 8 and 32, tested at 4 and 16",
        train=lambda log: gain(log) in (8, 32),
        groups=lambda log: (gain(log), arm(log)),
    ),
    "arm": Split(
        name="fitted with 0.535 kg at 0.10 m, tested with the other masses and arms",
        train=lambda log: arm(log) == (0.535, 0.1),
        groups=lambda log: (gain(log),),
    ),
    "heavy": Split(
        name="fitted with 0.969 kg at 0.15 m, tested with the other masses and arms",
        train=lambda log: arm(log) == (0.969, 0.15),
        groups=lambda log: (gain(log),),
    ),
}


def model_of(start: Model, terms: Sequence[str]) -> Model:
    """Return the servo with what its firmware does and some effects at their first guess."""
    added = tuple(NamedValues(name=name, values=TERMS[name]) for name in terms)
    return Model(actuator=start.actuator, effects=(*start.effects, *added), fit=MOTOR)


def fitted(logs: Sequence[ImportedLog], model: Model, terms: Sequence[str]) -> dict[int, float]:
    """Return the numbers of the motor and of the terms that fit some logs (column -> value)."""
    worlds = SearchWorlds(study_of(logs, model))
    found = fit_set(worlds, model, terms)
    return values_of(worlds, found.columns, found.place)


def study_of(logs: Sequence[ImportedLog], model: Model) -> Study:
    """Return logs ready to be compared with a model."""
    effects = [effect.name for effect in model.effects]
    return Study([log.recording for log in logs], model, effects, time_step=STEP)


def errors(logs: Sequence[ImportedLog], model: Model, values: dict[int, float]) -> Array:
    """Return the mean absolute error of the angle in each log [mrad], shape (R,)."""
    study = study_of(logs, model)
    columns = np.array([list(values)], dtype=np.intp)
    residuals = study.residuals(columns, np.array([list(values.values())]))
    return np.array([1e3 * np.abs(r.theta[0, r.trusted]).mean() for r in residuals])


def left_out_errors(
    logs: Sequence[ImportedLog], split: Split, start: Model, terms: Sequence[str]
) -> Array:
    """Return the mean absolute error [mrad] on each condition that was left out, shape (C,)."""
    model, out = model_of(start, terms), []
    for held in dict.fromkeys(condition for log in logs for condition in split.groups(log)):
        seen = [log for log in logs if held not in split.groups(log)]
        unseen = [log for log in logs if held in split.groups(log)]
        out.append(errors(unseen, model, fitted(seen, model, terms)).mean())
    return np.array(out)


def simplest_of_the_best(scores: dict[str, Array]) -> str:
    """Return the model of fewest numbers that is within one standard error of the best.

    The error is that of the difference, over the conditions that were left out.
    """
    best = min(scores, key=lambda name: float(scores[name].mean()))
    close = []
    for name, own in scores.items():
        worse = own - scores[best]
        if worse.mean() <= worse.std(ddof=1) / np.sqrt(worse.size):
            close.append(name)
    return min(close, key=lambda name: (number_count(name), float(scores[name].mean())))


def number_count(name: str) -> int:
    """Return how many numbers of effects a model fits."""
    return sum(len(TERMS[term]) for term in MODELS[name])


def repeat_floor(logs: Sequence[ImportedLog]) -> float:
    """Return the mean absolute deviation [mrad] of repeats from their median, in the same time."""
    groups: dict[str, list[Array]] = {}
    for log in logs:
        time, angle = log.recording.time, log.recording.motor_position[:, 0]
        grid = time[0] + np.arange(590) / 100.0
        groups.setdefault(log.source.stem[:-2], []).append(np.interp(grid, time, angle))
    repeated = [np.stack(runs) for runs in groups.values() if len(runs) > 1]
    return 1e3 * float(np.mean([np.abs(r - np.median(r, axis=0)).mean() for r in repeated]))


def report(logs: Sequence[ImportedLog], split: Split, start_of: Callable, names: list[str]) -> None:
    """Choose a model on the training logs of a split, and print what it leaves of the others."""
    train = [log for log in logs if split.train(log)]
    test = [log for log in logs if not split.train(log)]
    start = start_of(train)
    print(f"\n{split.name}: {len(train)} and {len(test)} logs", flush=True)
    bare = Model(actuator=start.actuator, fit=MOTOR)
    print(
        f"  start, a data sheet and no effect: {errors(test, bare, {}).mean():.1f} mrad", flush=True
    )
    scores = {}
    for name in names:
        scores[name] = left_out_errors(train, split, start, MODELS[name])
        row = " ".join(f"{error:5.1f}" for error in scores[name])
        values = fitted(train, model_of(start, MODELS[name]), MODELS[name])
        tested = errors(test, model_of(start, MODELS[name]), values).mean()
        print(
            f"  {name:34s} {scores[name].mean():5.1f} mrad left out ({row}), "
            f"{tested:5.1f} on the test logs, which choose nothing",
            flush=True,
        )
    best = simplest_of_the_best(scores)
    model = model_of(start, MODELS[best])
    values = fitted(train, model, MODELS[best])
    found = errors(test, model, values)
    own = errors(train, model, values).mean()
    print(f"  chosen: {best}; trained to {own:.1f}, held out {found.mean():.1f} mrad", flush=True)
    owners = study_of(train[:1], model).table.owners
    print("  " + ", ".join(f"{owners[c][1].name} {v:.4g}" for c, v in values.items()))
    for key in ("trajectory", "kp", "mass", "length"):
        kinds = sorted({log.conditions[key] for log in test}, key=str)
        means = [found[[log.conditions[key] == kind for log in test]].mean() for kind in kinds]
        print("  " + "  ".join(f"{key} {k}: {m:.1f}" for k, m in zip(kinds, means, strict=True)))


def main() -> None:
    """Read the logs and report each split."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path)
    parser.add_argument("--repeats", nargs="+", default=["1"], help="repeats that are used")
    parser.add_argument("--splits", nargs="+", choices=list(SPLITS), default=list(SPLITS))
    parser.add_argument("--models", nargs="+", choices=list(MODELS), default=list(MODELS))
    arguments = parser.parse_args()
    imported = read_bam(arguments.logs)
    print(f"repeats differ by {repeat_floor(imported.logs):.1f} mrad")
    logs = [log for log in imported.logs if log.source.stem[-1] in arguments.repeats]
    for name in arguments.splits:
        report(logs, SPLITS[name], imported.start_model, arguments.models)


if __name__ == "__main__":
    main()

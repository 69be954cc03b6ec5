"""Real XL330 logs: held-out errors of ever richer models.

``python -m lab.studies.xl330 LOGS`` trains on all position gains but one and tests on that
one, each in turn (or the one that ``--test`` names). Every model is refitted with the motor's
torque constant, resistance and armature. The logs are Rhoban/bam's (branch xl330); they are not
part of this repository.
"""

import argparse
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from lab.studies.named_causes import cause_lines
from tendon_lab.foreign_logs.bam import read_xl330
from tendon_newton.cli import main as tendon_newton
from tendon_newton.data.dataset import Dataset, load_dataset
from tendon_newton.data.model_file import Model, load_model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.diagnose import diagnose
from tendon_newton.diagnosis.evaluation import evaluate_models
from tendon_newton.diagnosis.search.fixed_set import fit_set_anew
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP, SearchWorlds
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.study import Study, replacements

COMPARED = (
    ("coulomb_friction", "viscous_friction"),
    ("load_dependent_friction", "viscous_friction"),
    ("load_dependent_friction", "viscous_friction", "coulomb_friction"),
    ("gear_load_friction", "viscous_friction", "coulomb_friction"),
    ("load_stribeck_friction", "viscous_friction", "stribeck_friction"),
    ("holding_friction", "viscous_friction"),
    ("load_dependent_friction", "viscous_friction", "gain_error"),
    ("load_dependent_friction", "viscous_friction", "torque_fade"),
    ("load_dependent_friction", "viscous_friction", "coulomb_friction", "torque_fade"),
)
"""Models that are fitted besides the diagnosed one.

The first, the fourth and the fifth have the terms of Rhoban/bam's m1, m3 and m4. In the fifth the
exponent of Stribeck's law is 2, and each of its two terms has a speed of its own.
"""
SMOOTHING = 15  # Rows over which ``--smooth`` takes the median of the supply's register: 80 ms


def main() -> None:
    """Import the logs, fit, diagnose and print a table for each gain that is held out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path)
    parser.add_argument(
        "--test", type=int, action="append", help="gains to hold out: each by default"
    )
    parser.add_argument("--smooth", action="store_true", help="take the median of the voltage")
    parser.add_argument("--diagnose", action="store_true", help="let a diagnosis choose as well")
    parser.add_argument("--all", action="store_true", help="fit all logs: nothing is held out")
    arguments = parser.parse_args()
    table: dict[str, dict[int, float]] = {}
    held = arguments.test or gains(arguments.logs)
    for gain in held[:1] if arguments.all else held:
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "dataset"
            words = ["--out", str(out), "--test", f"kp={gain}"]
            if tendon_newton(["import", "xl330", str(arguments.logs), *words]) != 0:
                raise SystemExit(2)
            dataset, model = load_dataset(out), load_model(out / "model.toml")
        dataset = smoothed(dataset) if arguments.smooth else dataset
        if arguments.all:
            dataset = replace(dataset, train=(*dataset.train, *dataset.test))
        for name, error in errors(dataset, model, diagnosed=arguments.diagnose).items():
            table.setdefault(name, {})[gain] = error
    print(f"\n{'held-out mean absolute error of theta [mrad], by the gain held out':76s}")
    for name, row in table.items():
        print(f"  {name:70s} " + "  ".join(f"kp {g}: {e:6.1f}" for g, e in row.items()))


def gains(logs: Path) -> list[int]:
    """Return the position gains of some logs, in firmware units."""
    return sorted({int(log.conditions["kp"]) for log in read_xl330(logs).logs})


def errors(dataset: Dataset, model: Model, *, diagnosed: bool) -> dict[str, float]:
    """Return the held-out mean absolute error of each model [mrad]; print what was fitted."""
    train = Study(dataset.train, model, tuple(EFFECTS), time_step=SEARCH_STEP)
    test = Study(dataset.test, model, tuple(EFFECTS))
    worlds = SearchWorlds(train)
    fitted = {"nominal": {}, "torque constant, resistance, armature": fit(worlds, model, ())}
    for effects in COMPARED:
        fitted[" + ".join(effects)] = fit(worlds, model, effects)
    if diagnosed:
        diagnosis, evidence = diagnose(dataset, model)
        fitted["diagnosed"] = evidence.extended
        print("\n".join((f"  {diagnosis.verdict}", *cause_lines(diagnosis, mean_absolute=True))))
    found = evaluate_models(test, list(fitted.values()))
    seen = evaluate_models(train, list(fitted.values()))
    for (name, values), of_test, of_train in zip(fitted.items(), found, seen, strict=True):
        held, own = (1e3 * error.pooled().theta_mae for error in (of_test, of_train))
        numbers = numbers_of(train, values)
        print(f"  {name:70s} {held:6.1f} mrad, trained to {own:6.1f} {numbers}", flush=True)
        print(f"    {', '.join(by_log(test, values))}", flush=True)
    return {name: 1e3 * error.pooled().theta_mae for name, error in zip(fitted, found, strict=True)}


def by_log(study: Study, values: Mapping[int, float]) -> list[str]:
    """Return each log's mean absolute error [mrad], in words."""
    residuals = study.residuals(*replacements([values]))
    return [
        f"{recording.name.removesuffix('.csv')} {1e3 * float(np.mean(np.abs(residual.theta))):.1f}"
        for recording, residual in zip(study.recordings, residuals, strict=True)
    ]


def fit(worlds: SearchWorlds, model: Model, effects: tuple[str, ...]) -> dict[int, float]:
    """Fit some effects and the motor's numbers together."""
    found = fit_set_anew(worlds, model, effects)
    return values_of(worlds, found.columns, found.place)


def numbers_of(study: Study, values: Mapping[int, float]) -> str:
    """Return fitted numbers in words."""
    owners = study.table.owners
    return ", ".join(f"{owners[c][1].name} {value:.4g}" for c, value in values.items())


def smoothed(dataset: Dataset) -> Dataset:
    """Return recordings whose supply is the running median of its register."""
    return replace(
        dataset,
        train=tuple(map(with_median, dataset.train)),
        test=tuple(map(with_median, dataset.test)),
    )


def with_median(recording: Recording) -> Recording:
    """Replace the supply of one recording by its running median."""
    assert recording.voltage is not None
    padded = np.pad(recording.voltage, SMOOTHING // 2, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, SMOOTHING)
    return replace(recording, voltage=np.median(windows, axis=1))


if __name__ == "__main__":
    main()

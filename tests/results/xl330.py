"""Real XL330 logs: held-out errors of ever richer models, ``python -m tests.results.xl330 LOGS``.

Trains on the position gains 100 and 800 and tests on 200 (or as ``--test kp=...`` says), each model
refitted with the motor's torque constant, resistance and armature. The logs are Rhoban/bam's
(branch xl330); they are not part of this repository.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

from tendon_newton.cli import main as tendon_newton
from tendon_newton.dataset import load_dataset
from tendon_newton.diagnosis.diagnose import SEARCH_STEP, diagnose, values_of
from tendon_newton.diagnosis.evaluation import evaluate_models
from tendon_newton.diagnosis.search import Search
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.study import Study
from tendon_newton.model_file import load_model

COMPARED = (("coulomb_friction", "viscous_friction"),)
"""Models that are fitted besides the diagnosed one."""


def main() -> None:
    """Import the logs, fit, diagnose and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path)
    parser.add_argument("--test", default="kp=200")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "dataset"
        words = ["--out", str(out), "--test", arguments.test]
        if tendon_newton(["import", "xl330", str(arguments.logs), *words]) != 0:
            raise SystemExit(2)
        report(out)


def report(folder: Path) -> None:
    """Print the held-out mean absolute error of each model."""
    dataset, model = load_dataset(folder), load_model(folder / "model.toml")
    train = Study(dataset.train, model, tuple(EFFECTS), time_step=SEARCH_STEP)
    test = Study(dataset.test, model, tuple(EFFECTS))
    search = Search(train, model)
    baseline = search.baseline()
    fitted = {"nominal": {}, "torque constant, resistance, armature": values_of(baseline)}
    for effects in COMPARED:
        candidate, _ = search.problem(effects, baseline)
        found, _ = search.descend([candidate], search.gap_scales(baseline))
        fitted[" + ".join(effects)] = values_of(found[0])
    diagnosis, evidence = diagnose(dataset, model)
    fitted["diagnosed: " + " + ".join(e.name for e in diagnosis.effects)] = evidence.extended
    errors = evaluate_models(test, list(fitted.values()))
    print(f"\n{'model':64s} held-out mean absolute error of theta")
    for name, error in zip(fitted, errors, strict=True):
        print(f"{name:64s} {1e3 * error.pooled().theta_mae:7.1f} mrad")
    for effect in diagnosis.effects:
        rivals = f"  (not told from {', '.join(effect.indistinguishable_from)})"
        fitted_numbers = effect.parameters.items()
        numbers = {n: np.round([e.value, *e.ci95], 5).tolist() for n, e in fitted_numbers}
        print(f"  {effect.name} {numbers}{rivals if effect.indistinguishable_from else ''}")


if __name__ == "__main__":
    main()

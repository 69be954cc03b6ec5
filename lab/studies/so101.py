"""Real SO-101 logs: how much of what a servo does wrong has a name, ``... so101 LOGS``.

Each joint's causes are found on two motions, the sweep and the one that goes furthest, and tested
on all others, against a servo that is where it was told to be. The logs are isaac-sim2real/sage's;
they are not part of this repository.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

from lab.studies.named_causes import cause_lines
from tendon_lab.foreign_logs.so101 import read_so101
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.importers.imported import Imported, ImportedLog
from tendon_newton.diagnosis.diagnose import Evidence, diagnose
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.identification.study import replacements

MOVED = 0.02  # A joint whose command spans less in a motion [rad] only holds still there
SWEEP = "chirp_sweep"  # The motion that holds all frequencies


def main() -> None:
    """Import, diagnose each joint and print what is left on motions that no fit has seen."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path)
    parser.add_argument("--joint", action="append", help="joints: all by default")
    parser.add_argument("--train", help="two motions in place of each joint's own, a,b")
    arguments = parser.parse_args()
    imported = read_so101(arguments.logs)
    for joint in arguments.joint or joints(imported):
        logs = [log for log in imported.logs if log.conditions["joint"] == joint]
        names = tuple(arguments.train.split(",")) if arguments.train else training_motions(logs)
        with tempfile.TemporaryDirectory() as folder:
            data = split(Path(folder), logs, names)
            diagnosis, evidence = diagnose(data, imported.start_model(logs))
        report(joint, names, diagnosis, evidence)


def joints(imported: Imported) -> list[str]:
    """Return the names of the joints, in their order."""
    return list(dict.fromkeys(str(log.conditions["joint"]) for log in imported.logs))


def training_motions(logs: list[ImportedLog]) -> tuple[str, str]:
    """Return the sweep and, of the others, the motion whose command spans most.

    Only commands decide: nothing that was measured.
    """
    spans = {
        str(log.conditions["motion"]): float(np.ptp(log.recording.command))
        for log in logs
        if log.recording.command is not None
    }
    return SWEEP, max((motion for motion in spans if motion != SWEEP), key=spans.__getitem__)


def split(folder: Path, logs: list[ImportedLog], train: tuple[str, ...]) -> Dataset:
    """Train on some motions, test on all others."""
    seen = tuple(log.recording for log in logs if log.conditions["motion"] in train)
    held = tuple(log.recording for log in logs if log.conditions["motion"] not in train)
    return Dataset(path=folder, train=seen, test=held)


def report(joint: str, train: tuple[str, ...], diagnosis: Diagnosis, evidence: Evidence) -> None:
    """Print the causes of one joint and the held-out errors, motion by motion."""
    before, after = diagnosis.baseline.theta_rmse, diagnosis.extended.theta_rmse
    print(
        f"\n{joint}, trained on {' and '.join(train)}: {diagnosis.verdict}; held out "
        f"{1e3 * before:.1f} -> {1e3 * after:.1f} mrad RMS ({100 * (1 - after / before):.0f} % "
        f"less), {100 * (1 - (after / before) ** 2):.0f} % of the squared error"
    )
    print("\n".join(cause_lines(diagnosis)))
    residuals = evidence.test.residuals(*replacements([evidence.baseline, evidence.extended]))
    for recording, residual in zip(evidence.test.recordings, residuals, strict=True):
        assert recording.command is not None
        moves = "" if np.ptp(recording.command) > MOVED else "  (holds still)"
        rms = 1e3 * np.sqrt(np.mean(residual.theta**2, axis=1))
        print(f"    {recording.name:40s} {rms[0]:7.1f} -> {rms[1]:6.1f} mrad{moves}")


if __name__ == "__main__":
    main()

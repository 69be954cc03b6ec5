"""Files that only the lab reads; `python -m tests.fuzz --groups lab.tests.fuzz_targets`."""

import json
from collections.abc import Callable
from pathlib import Path

from lab.tests.exam.test_broken_exams import TRUTH
from lab.tests.foreign_logs.bam_files import bam_log, bam_parameters
from lab.tests.foreign_logs.test_import_so101 import write_motion
from tendon_lab.exam.truth_file import read_truth
from tendon_lab.foreign_logs.bam import read_bam, read_parameters, read_xl330
from tendon_lab.foreign_logs.so101 import read_so101
from tests.fuzz.imports import change_json
from tests.fuzz.mutations import change_cells, change_lines, either, flip, table_changer
from tests.fuzz.targets import Target, put
from tests.importers.logs import xl330_log


def xl330_file(folder: Path) -> Path:
    """Write a log of a servo on a pendulum."""
    return xl330_log(folder / "logs" / "a_sin.json")


def read_xl330_folder(path: Path) -> None:
    """Read the folder of a spoilt log."""
    read_xl330(path.parent)


def so101_file(folder: Path) -> Path:
    """Write a motion of an arm."""
    write_motion(folder / "logs" / "slow")
    return folder / "logs" / "slow" / "state_motor.csv"


def read_so101_folder(path: Path) -> None:
    """Read the folder of a spoilt motion."""
    read_so101(path.parents[1])


def bam_file(folder: Path) -> Path:
    """Write a log of Rhoban/bam."""
    return bam_log(folder / "logs" / "a_sin.json")


def read_bam_folder(path: Path) -> None:
    """Read the folder of a spoilt log."""
    read_bam(path.parent)


def bam_parameter_file(folder: Path) -> Path:
    """Write a parameter file of Rhoban/bam."""
    return bam_parameters(folder / "m6.json")


def read_truth_file(path: Path) -> None:
    """Read what is hidden in a dataset of an exam."""
    read_truth(path)


def lab_files() -> dict[str, Target]:
    """Published logs, parameters of other programs, and truths of exams."""
    return {
        "truth": Target(
            put("c001.json", json.dumps(TRUTH)), table_changer(TRUTH, json.dumps), read_truth_file
        ),
        "xl330": Target(xl330_file, change_json, read_xl330_folder),
        "bam": Target(bam_file, change_json, read_bam_folder),
        "bam-parameters": Target(bam_parameter_file, change_json, read_parameters),
        "so101": Target(so101_file, either(change_cells, change_lines, flip), read_so101_folder),
    }


GROUPS: dict[str, Callable[[], dict[str, Target]]] = {"lab": lab_files}

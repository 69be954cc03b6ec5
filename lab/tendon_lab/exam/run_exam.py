"""A folder of datasets with known truths, diagnosed in parallel; a broken-off exam goes on."""

import hashlib
import json
import resource
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from tendon_lab.exam.exam_score import Mark, Truth, judge
from tendon_lab.exam.truth_file import read_truth
from tendon_newton.data.dataset import all_files, read_entries
from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.files.origin import content_hash, file_hash
from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.files.together import together, with_hashes
from tendon_newton.data.files.values import is_table
from tendon_newton.diagnosis.diagnosis_file import state_diagnosis
from tendon_newton.errors import InvalidDataset, InvalidDiagnosis, TendonNewtonError, unknown_name
from tendon_newton.scheduler import JobOptions, completed

ANSWER = "diagnosis.json"
QUESTION = "question_sha256"  # Key of an answer with the hash of what was asked


def read_truths(folder: Path) -> list[Truth]:
    """Read all truths of an exam, in order of their names.

    Raises:
        InvalidDataset: The folder holds none, or a truth without its dataset.
    """
    truths = [read_truth(path) for path in sorted((folder / "truth").glob("*.json"))]
    if not truths:
        raise InvalidDataset(
            f"{folder}: an exam holds folders with dataset.toml and model.toml, and "
            "truth/NAME.json for each; no truth was found"
        )
    for truth in truths:
        if not (folder / truth.id / "dataset.toml").is_file():
            raise InvalidDataset(
                f"{folder}: truth/{truth.id}.json speaks of {truth.id}/, which has no dataset.toml"
            )
    return truths


def take_exam(
    folder: Path, out: Path, *, options: JobOptions, only: Sequence[str] = ()
) -> Iterator[Mark]:
    """Diagnose every dataset that has no answer to what it holds, and yield marks as they come.

    Args:
        folder: Datasets and their truths.
        out: Where answers go, one folder each.
        options: Where diagnoses are done; one process per core is best.
        only: Names of datasets; all by default.
    """
    truths = read_truths(folder)
    for name in only:
        if name not in (truth.id for truth in truths):
            raise unknown_name("dataset", name, [truth.id for truth in truths])
    truths = [truth for truth in truths if not only or truth.id in only]
    waiting: list[Truth] = []
    for truth in truths:
        answer = read_answer(out / truth.id / ANSWER)
        if answer is None or answer.get(QUESTION) != question_of(folder / truth.id):
            waiting.append(truth)
        else:
            yield replace(judge(truth, answer), earlier=True)
    folders = {(folder / truth.id, out / truth.id): truth for truth in waiting}
    for paths, answer in completed(answer_one, list(folders), options):
        yield judge(folders[paths], answer)


def answer_one(paths: tuple[Path, Path]) -> dict[str, Any] | None:
    """Diagnose one dataset and write its answer; None if it cannot be diagnosed.

    Args:
        paths: Folder of the dataset, and of the answer.
    """
    dataset, out = paths
    from tendon_newton.data.dataset import load_dataset
    from tendon_newton.data.model_file import load_model, write_model
    from tendon_newton.device_code.quiet import quiet_warp
    from tendon_newton.diagnosis.diagnose import diagnose

    quiet_warp()
    out.mkdir(parents=True, exist_ok=True)
    question = question_of(dataset)
    try:
        diagnosis, _ = diagnose(
            load_dataset(dataset), load_model(dataset / "model.toml"), progress=whole
        )
    except TendonNewtonError as error:
        write_text(out / "error.txt", f"{error}\n")
        return None
    answer = {**diagnosis.to_json(), "peak_memory_mib": peak_memory(), QUESTION: question}
    with together() as drafts:
        write_model(out / "model.toml", diagnosis.model)
        write_json(out / ANSWER, with_hashes(answer, drafts, out))
    return answer


def question_of(dataset: Path) -> str:
    """Return a hash of all that an answer is made from: recordings, their list and the model."""
    listed = hashlib.sha256()
    for file in all_files(dataset, read_entries(dataset)):
        listed.update(file.relative_to(dataset).as_posix().encode())
        listed.update(file_hash(file).encode())
    asked = f"{listed.hexdigest()} {file_hash(dataset / 'model.toml')}"
    return content_hash(asked.encode())


def whole(told: str) -> None:
    """Let an interrupt end a search: what half of it would say is no answer of an exam."""
    if told.startswith("ending the search"):
        raise KeyboardInterrupt


def peak_memory() -> float:
    """Return the most memory that this process has used so far [MiB]."""
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return round(used / (1024.0**2 if sys.platform == "darwin" else 1024.0), 1)


def read_answer(path: Path) -> dict[str, Any] | None:
    """Read an answer that an earlier run left; None if there is none or it broke off.

    Raises:
        InvalidDiagnosis: The file is whole and no diagnosis: something else would be overwritten.
    """
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    answer = table if is_table(table) else {}
    state_diagnosis(CheckedTable(answer, str(path), InvalidDiagnosis))
    return answer

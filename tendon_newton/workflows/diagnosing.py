"""Diagnose a dataset and write all files of the answer."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tendon_newton.data.dataset import Dataset
from tendon_newton.data.files.text_file import make_folder
from tendon_newton.data.model_file import Model, write_model
from tendon_newton.diagnosis.diagnose import diagnose
from tendon_newton.diagnosis.identified import write_identified
from tendon_newton.diagnosis.reporting.report import Origin, write_report
from tendon_newton.diagnosis.result import Diagnosis, write_diagnosis


@dataclass(frozen=True, kw_only=True)
class DiagnosisAnswer:
    """A diagnosis and where it was written."""

    diagnosis: Diagnosis
    layers: tuple[Path, ...]
    """USD layers of what was found about the mechanisms."""


def diagnose_into(
    out: Path,
    dataset: Dataset,
    model: Model,
    origin: Origin,
    *,
    progress: Callable[[str], None],
    budget: float | None = None,
) -> DiagnosisAnswer:
    """Diagnose, and write ``diagnosis.json`` last: where it stands, all else stands.

    Args:
        out: Folder of the results; made if it is not there.
        dataset: Training recordings decide, test recordings only report.
        model: The model to start from.
        origin: Where the recordings are from, for the report.
        progress: Told what is being done.
        budget: Time that it may take, about [s].
    """
    make_folder(out)
    diagnosis, evidence = diagnose(dataset, model, progress=progress, budget=budget)
    write_model(out / "model.toml", diagnosis.model)
    write_report(out / "report.html", diagnosis, evidence, origin)
    layers = write_identified(out, diagnosis, dataset)
    write_diagnosis(out / "diagnosis.json", diagnosis)
    return DiagnosisAnswer(diagnosis=diagnosis, layers=layers)

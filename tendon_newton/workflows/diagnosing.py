"""Diagnose a dataset, and write all files of the answer."""

from collections.abc import Callable
from pathlib import Path

from tendon_newton.data.dataset import Dataset
from tendon_newton.data.files.output_folder import make_folder
from tendon_newton.data.files.together import together
from tendon_newton.data.model_file import Model, write_model
from tendon_newton.diagnosis.diagnose import diagnose
from tendon_newton.diagnosis.diagnosis_file import ANSWER, MODEL
from tendon_newton.diagnosis.reporting.report import Origin, write_report
from tendon_newton.diagnosis.result import Diagnosis, write_diagnosis
from tendon_newton.errors import InvalidOutput


def diagnose_into(
    out: Path,
    dataset: Dataset,
    model: Model,
    origin: Origin,
    *,
    progress: Callable[[str], None],
    budget: float | None = None,
    finish: Callable[[Diagnosis], Model] = lambda diagnosis: diagnosis.model,
) -> Diagnosis:
    """Diagnose, and write all files of the answer, or none of them.

    Args:
        out: Folder of the results; made if it is not there.
        dataset: Training recordings decide, test recordings report, and may take names back.
        budget: Time that it may take, about [s].
        finish: Gives the model that is written.
    """
    make_folder(out)
    diagnosis, evidence = diagnose(dataset, model, progress=progress, budget=budget)
    try:
        with together():
            write_model(out / MODEL, finish(diagnosis))
            write_report(out / "report.html", diagnosis, evidence, origin)
            write_diagnosis(out / ANSWER, diagnosis)
    except InvalidOutput:
        progress(f"found, but not written:\n{diagnosis!r}\n")
        raise
    return diagnosis

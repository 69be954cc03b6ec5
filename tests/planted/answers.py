"""The diagnosis of a folder with planted causes, as a user would ask for it."""

from pathlib import Path
from typing import Any

from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.files.together import together
from tendon_newton.data.model_file import load_model, write_model
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.diagnosis.diagnose import diagnose
from tendon_newton.diagnosis.result import write_diagnosis

ANSWER = "diagnosis.json"


def answer_of(dataset: Path, out: Path) -> dict[str, Any]:
    """Diagnose a dataset from the model beside it, write the answer, and return it."""
    quiet_warp()
    model = load_model(dataset / "model.toml")
    diagnosis, _ = diagnose(load_dataset(dataset), model, progress=lambda _: None)
    out.mkdir(parents=True, exist_ok=True)
    with together():
        write_model(out / "model.toml", diagnosis.model)
        write_diagnosis(out / ANSWER, diagnosis)
    return diagnosis.to_json()

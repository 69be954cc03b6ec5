"""An answer is kept as long as its question is the same."""

import json
from pathlib import Path

from tendon_lab.exam import run_exam
from tendon_newton.data.dataset import load_dataset
from tendon_newton.scheduler import JobOptions
from tests.diagnosis.test_accounts import told
from tests.held_out import small_dataset


def test_an_exam_asks_anew_what_has_changed(tmp_path: Path, monkeypatch) -> None:
    """The answer to other recordings, or from another model, is no answer; the same one is kept."""
    exam, out = tmp_path / "exam", tmp_path / "out"
    data = small_dataset(exam / "one")
    (exam / "truth").mkdir()
    truth = {"id": "one", "family": "clean", "effects": []}
    (exam / "truth" / "one.json").write_text(json.dumps(truth))
    asked: list[str] = []

    def answer(paths: tuple[Path, Path]) -> object:
        asked.append(paths[0].name)
        said = told("no_gap").to_json() | {
            "peak_memory_mib": 1.0,
            run_exam.QUESTION: run_exam.question_of(paths[0]),
        }
        paths[1].mkdir(parents=True, exist_ok=True)
        (paths[1] / run_exam.ANSWER).write_text(json.dumps(said))
        return said

    monkeypatch.setattr(run_exam, "answer_one", answer)

    def take() -> int:
        asked.clear()
        assert len(list(run_exam.take_exam(exam, out, options=JobOptions()))) == 1
        return len(asked)

    assert [take(), take()] == [1, 0]
    (data / "model.toml").write_text((data / "model.toml").read_text() + "# other\n")
    assert [take(), take()] == [1, 0]
    file = data / load_dataset(data).test[0].name
    file.write_text(file.read_text().replace("\n0.0", "\n0.00001", 1))
    assert [take(), take()] == [1, 0]

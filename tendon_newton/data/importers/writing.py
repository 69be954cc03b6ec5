"""Writing an import: the dataset, a model to start from, and what was found in the data."""

import json
import shlex
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from tendon_newton.data.checks.bench_checks import BenchFacts
from tendon_newton.data.checks.finding import Finding, findings_text
from tendon_newton.data.checks.lint import lint_dataset, lint_recording
from tendon_newton.data.dataset import FILE_NAME, write_dataset
from tendon_newton.data.files.output_folder import make_folder
from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.files.together import together
from tendon_newton.data.importers.imported import Imported, ImportedLog
from tendon_newton.data.importers.split import Split
from tendon_newton.data.model_file import write_model
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidOutput

REPORT_NAME = "import.json"


@dataclass(frozen=True, kw_only=True)
class ImportReport:
    """Written logs and findings, for a reader and for ``import.json``."""

    split: Split  # Logs of the train and of the test recordings
    findings: tuple[Finding, ...]  # Everything found in the logs that were written

    @property
    def split_lines(self) -> list[str]:
        """How many recordings were written, and what was not."""
        split = self.split
        lines = [f"{len(split.train)} train, {len(split.test)} test recordings"]
        if split.left_out:
            names = ", ".join(log.source.name for log in split.left_out)
            lines += [f"left out, selected by no condition: {names}"]
        if split.chosen:
            (held,) = split.test
            lines += [f"held out as test, since --test names none: {held.recording.name}"]
        return lines

    @property
    def text(self) -> str:
        """The report for a reader: each kind of finding once, with its evidence by file."""
        return "\n".join(self.split_lines + findings_text(self.findings))

    def next_command(self, out: Path) -> str:
        """Return the command that makes something of the dataset in a folder."""
        words = ["tendon-newton", "diagnose", str(out), "--out", f"{out}_diagnosis"]
        return shlex.join(words if self.split.test else [*words, "--hold-out", "0.3"])


def write_import(
    imported: Imported,
    split: Split,
    out: Path,
    known_bench: Callable[[Recording], BenchFacts | None] = lambda _: None,
) -> ImportReport:
    """Write the dataset, ``model.toml``, ``import.json`` and ``import.txt``.

    Args:
        known_bench: Gives what is known of a recording's bench; None where nothing is.
    """
    refuse_foreign_folder(out, [log.source for log in imported.logs])
    make_folder(out, dataset=True)
    train = [log.recording for log in split.train]
    test = [log.recording for log in split.test]
    written = {recording.name for recording in (*train, *test)}
    found = [
        finding
        for recording in (*train, *test)
        for finding in lint_recording(recording, imported.limits, known_bench(recording))
    ]
    told = [f for f in imported.findings if f.recording in written or f.recording == "all"]
    report = ImportReport(split=split, findings=(*told, *found, *lint_dataset(train, test)))
    with together():
        write_dataset(out, train, test)
        write_model(out / "model.toml", imported.start_model(split.train))
        write_text(out / REPORT_NAME, json.dumps(report_table(report), indent=2) + "\n")
        write_text(out / "import.txt", report.text + "\n")
    return report


def refuse_foreign_folder(out: Path, sources: Sequence[Path]) -> None:
    """Refuse to write where something else than an earlier import lies."""
    if out.exists() and not out.is_dir():
        raise InvalidOutput(f"{out}: --out must be a folder; it is a file")
    if out.resolve() in {source.resolve().parent for source in sources}:
        raise InvalidOutput(f"{out}: --out must not be the folder that is imported")
    if (out / FILE_NAME).exists() and not (out / REPORT_NAME).exists():
        raise InvalidOutput(
            f"{out}: --out must be new or hold an earlier import; it holds a dataset "
            "that was not imported"
        )


def report_table(report: ImportReport) -> dict[str, object]:
    """Make the table of ``import.json``."""
    groups = {
        "train": report.split.train,
        "test": report.split.test,
        "left_out": report.split.left_out,
    }
    return {
        "schema": 1,
        "recordings": [log_table(log, name) for name, logs in groups.items() for log in logs],
        "findings": [asdict(finding) for finding in report.findings],
    }


def log_table(log: ImportedLog, split: str) -> dict[str, object]:
    """Say where a recording came from."""
    return {
        "file": log.recording.name,
        "split": split,
        "source": log.source.name,
        "sha256": log.sha256,
        "conditions": dict(log.conditions),
    }

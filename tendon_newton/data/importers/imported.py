"""What an importer gives: recordings, what they can be selected by, and a model to start from."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tendon_newton.data.checks.finding import Finding
from tendon_newton.data.files.file_names import check_name
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidRecording


@dataclass(frozen=True, kw_only=True)
class ImportedLog:
    """One recording with the circumstances that its source states."""

    recording: Recording  # The data in the names and units of our files
    # Circumstances by which a split can select it (``kp``, ``trajectory``)
    conditions: Mapping[str, float | str]
    source: Path  # The file it came from
    sha256: str  # Digest of that file
    open_start: bool = False  # Whether nothing says from which state a simulation of it starts

    def __post_init__(self) -> None:
        check_name(self.recording.name, f"{self.source}: a recording's name", InvalidRecording)


@dataclass(frozen=True, kw_only=True)
class Imported:
    """Everything that one folder of foreign logs gave."""

    logs: tuple[ImportedLog, ...]  # One per file, in the order of their names
    # Makes the model to start from, with its unknown numbers listed in ``fit``, out of the logs
    # that may be fitted
    start_model: Callable[[Sequence[ImportedLog]], Model]
    limits: Mapping[str, float]  # Known limits by column [column's unit]
    # What only the importer could see, because it knows the source's registers
    findings: tuple[Finding, ...]

    # Condition whose values become a dataset each; None where all logs belong into one
    split_by: str | None = None

    @property
    def model(self) -> Model:
        """The model to start from where every log may be fitted."""
        return self.start_model(self.logs)

    def parts(self) -> dict[str, "Imported"]:
        """Return what becomes a dataset each, by the name of its folder; empty for one dataset."""
        if self.split_by is None:
            return {}
        values = dict.fromkeys(str(log.conditions[self.split_by]) for log in self.logs)
        for value in values:
            check_name(value, f"a {self.split_by}'s name", InvalidRecording)
        return {
            value: replace(
                self,
                logs=tuple(log for log in self.logs if str(log.conditions[self.split_by]) == value),
                split_by=None,
            )
            for value in values
        }

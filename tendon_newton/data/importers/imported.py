"""What an importer gives: recordings, what they can be selected by, and a model to start from."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tendon_newton.data.checks.finding import Finding
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording


@dataclass(frozen=True, kw_only=True)
class ImportedLog:
    """One recording with the circumstances that its source states."""

    recording: Recording
    """The data in the names and units of our files."""
    conditions: Mapping[str, float | str]
    """Circumstances by which a split can select it (``kp``, ``trajectory``)."""
    source: Path
    """The file it came from."""
    sha256: str
    """Digest of that file."""


@dataclass(frozen=True, kw_only=True)
class Imported:
    """Everything that one folder of foreign logs gave."""

    logs: tuple[ImportedLog, ...]
    """One per file, in the order of their names."""
    start_model: Callable[[Sequence[ImportedLog]], Model]
    """Makes the model to start from, with its unknown numbers listed in ``fit``, out of the logs
    that may be fitted."""
    limits: Mapping[str, float]
    """Known limits by column [column's unit]."""
    findings: tuple[Finding, ...]
    """What only the importer could see, because it knows the source's registers."""

    @property
    def model(self) -> Model:
        """The model to start from where every log may be fitted."""
        return self.start_model(self.logs)

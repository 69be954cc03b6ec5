"""What every target of an export declares, and what an export hands back."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.rollout import Trajectory

# Whether a target says what an effect does: as it is, nearly, or not at all
Coverage = Literal["exact", "approximate", "none"]
Replay = Callable[[Recording], Trajectory]


@dataclass(frozen=True, kw_only=True)
class Exported:
    """What an export wrote, and how to run it."""

    files: tuple[Path, ...]
    loading: str  # How a user loads the files, in Markdown
    # Ways in which the target runs what was written, where it is installed: name -> replay
    replays: Mapping[str, Replay] = field(default_factory=dict)
    # Effects of the model that each way of running it does not have, or not as they are
    left_out: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    # Those of them that it has in another form
    nearly: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class ExportTarget:
    """One program that an identified model can be carried into."""

    coverage: Mapping[str, Coverage]  # What becomes of each effect of the catalogue
    # (folder, bench with the model's own numbers, model) -> what was written
    write: Callable[[Path, Mechanism, Model], Exported]

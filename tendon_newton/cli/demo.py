"""Diagnose the recordings that come with the program: a friction is hidden in them.

    tendon-newton demo

takes under a minute. The report, demo/report.html, names the friction and its size.
"""

from dataclasses import dataclass
from pathlib import Path

from tendon_newton.errors import InvalidDataset

_PACKAGE = Path(__file__).resolve().parents[1]
_FOLDERS = (_PACKAGE / "_demo", _PACKAGE.parent / "examples" / "hidden_friction")
"""A wheel carries the recordings inside the package; a clone has them beside it."""


@dataclass(frozen=True, kw_only=True)
class DemoConfig:
    """Diagnose the recordings that come with the program."""

    out: Path = Path("demo")  # Folder for the results; made if it is not there.


def main(config: DemoConfig) -> None:
    """Diagnose them as the verb diagnose would."""
    from tendon_newton.cli.diagnosis.diagnose import DiagnoseConfig
    from tendon_newton.cli.diagnosis.diagnose import main as diagnose

    diagnose(DiagnoseConfig(dataset=demo_folder(), out=config.out))


def demo_folder() -> Path:
    """Return the folder of the recordings that come with the program."""
    for folder in _FOLDERS:
        if folder.is_dir():
            return folder
    raise InvalidDataset(
        f"the recordings of the demo are missing; looked for {_FOLDERS[0]} and {_FOLDERS[1]}"
    )

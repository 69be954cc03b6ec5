"""Turn foreign logs into a dataset, with a report of what is wrong with them."""

from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True, kw_only=True)
class ImportConfig:
    """Where the logs are, where the dataset goes, and which logs are held out."""

    format: tyro.conf.Positional[str]
    """Format of the logs: xl330."""
    source: tyro.conf.Positional[Path]
    """Folder of the logs."""
    out: Path
    """Folder for the dataset; new, or one that an earlier import wrote."""
    test: tuple[str, ...] = ()
    """Logs of the test split, as conditions that must all hold: kp=200 trajectory=sin_sin."""
    train: tuple[str, ...] = ()
    """Logs of the train split, likewise (kp=100,800 gives two values); all others by default."""


def main(config: ImportConfig) -> None:
    """Import, write and report."""
    from tendon_newton.errors import unknown_name
    from tendon_newton.importers import IMPORTERS
    from tendon_newton.importers.split import read_conditions, split_logs
    from tendon_newton.importers.writing import write_import

    if config.format not in IMPORTERS:
        raise unknown_name("log format", config.format, IMPORTERS)
    test = read_conditions(config.test, "--test")
    train = read_conditions(config.train, "--train")
    imported = IMPORTERS[config.format](config.source)
    split = split_logs(imported.logs, test, train)
    report = write_import(imported, split, config.out)
    print(f"{config.out}: {report.text}")

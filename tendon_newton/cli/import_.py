"""Turn foreign logs into a dataset, with a report of what is wrong with them."""

from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True, kw_only=True)
class ImportConfig:
    """Where the logs are, where the dataset goes, and which logs are held out."""

    format: tyro.conf.Positional[str]
    """Format of the logs: xl330, so101, or mapped for any CSV, JSON or ROS 2 bag with --mapping."""
    source: tyro.conf.Positional[Path]
    """Folder of the logs."""
    out: Path
    """Folder for the dataset; new, or one that an earlier import wrote."""
    test: tuple[str, ...] = ()
    """Logs of the test split, as conditions that must all hold: kp=200 trajectory=sin_sin."""
    train: tuple[str, ...] = ()
    """Logs of the train split, likewise (kp=100,800 gives two values); all others by default."""
    mapping: Path | None = None
    """For mapped: the file that says which of their columns or topics, in which unit, is which of
    ours (docs/recordings_mapping.md)."""


def main(config: ImportConfig) -> None:
    """Import, write and report."""
    from tendon_newton.data.importers import IMPORTERS, MAPPED
    from tendon_newton.data.importers.mapped import read_mapped
    from tendon_newton.data.importers.split import read_conditions, split_logs
    from tendon_newton.data.importers.writing import write_import
    from tendon_newton.errors import InvalidParameter, unknown_name

    if config.format not in (*IMPORTERS, MAPPED):
        raise unknown_name("log format", config.format, (*IMPORTERS, MAPPED))
    if (config.mapping is None) == (config.format == MAPPED):
        raise InvalidParameter(
            "--mapping belongs to the format mapped, which needs it; the format is "
            f"{config.format!r} and --mapping is {'missing' if config.mapping is None else 'there'}"
        )
    test = read_conditions(config.test, "--test")
    train = read_conditions(config.train, "--train")
    imported = (
        IMPORTERS[config.format](config.source)
        if config.mapping is None
        else read_mapped(config.source, config.mapping)
    )
    split = split_logs(imported.logs, test, train)
    report = write_import(imported, split, config.out)
    print(f"{config.out}: {report.text}")
